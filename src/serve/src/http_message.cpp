#include "terrane/serve/http_message.h"

#include <unistd.h>

#include <array>

namespace terrane::serve {

ServedFile::~ServedFile() {
  ::close(descriptor_);
}

std::string_view routeName(Route route) {
  static constexpr std::array<std::string_view, kRouteCount> kNames = {
      "page",  "list",   "manifest", "archive",   "tile",   "xyz",
      "query", "health", "metrics",  "preflight", "refused"};
  return kNames[static_cast<size_t>(route)];
}

void HttpResponse::add(std::string_view name, std::string_view value) {
  headers.append(name).append(": ").append(value).append("\r\n");
}

std::string_view reasonPhrase(int status) {
  switch (status) {
    case 200:
      return "OK";
    case 204:
      return "No Content";
    case 206:
      return "Partial Content";
    case 304:
      return "Not Modified";
    case 400:
      return "Bad Request";
    case 404:
      return "Not Found";
    case 405:
      return "Method Not Allowed";
    case 408:
      return "Request Timeout";
    case 411:
      return "Length Required";
    case 412:
      return "Precondition Failed";
    case 413:
      return "Content Too Large";
    case 414:
      return "URI Too Long";
    case 415:
      return "Unsupported Media Type";
    case 416:
      return "Range Not Satisfiable";
    case 417:
      return "Expectation Failed";
    case 431:
      return "Request Header Fields Too Large";
    case 503:
      return "Service Unavailable";
    case 505:
      return "HTTP Version Not Supported";
    default:
      return "Internal Server Error";
  }
}

HttpResponse refuse(int status, std::string words) {
  HttpResponse response;
  response.status = status;
  response.add("Content-Type", "text/plain; charset=utf-8");
  response.add("Cache-Control", "no-store");
  response.text = std::move(words);
  response.text += '\n';
  return response;
}

}  // namespace terrane::serve

#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

namespace terrane {

/// A server that answers as a test tells it, byte by byte: also what no honest server would say.
class ScriptedServer {
 public:
  struct Request {
    std::string target;                         ///< "/made/manifest.json?key=1"
    std::map<std::string, std::string> fields;  ///< names in lower case
    std::string field(const std::string& name) const {
      const auto at = fields.find(name);
      return at == fields.end() ? std::string() : at->second;
    }
  };
  struct Reply {
    std::string bytes;     ///< head and body
    bool closes = false;   ///< the connection ends behind them
    bool resets = false;   ///< it breaks
    bool endless = false;  ///< the last byte goes on and on
    bool hangs = false;    ///< nothing more comes, and nothing ends
  };
  using Script = std::function<Reply(const Request&)>;

  /// Listens on the loopback; port 0: any that is free. Any number of connections, a thread each.
  explicit ScriptedServer(Script script, int port = 0) : script_(std::move(script)) {
    listening_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const int yes = 1;
    ::setsockopt(listening_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t length = sizeof(address);
    if (::bind(listening_, reinterpret_cast<sockaddr*>(&address), length) != 0 ||
        ::listen(listening_, 64) != 0 ||
        ::getsockname(listening_, reinterpret_cast<sockaddr*>(&address), &length) != 0)
      std::abort();
    port_ = ntohs(address.sin_port);
    accepting_ = std::thread([this] { acceptInThread(); });
  }
  ~ScriptedServer() {
    {
      const std::lock_guard lock(mutex_);
      ended_ = true;
      for (const int socket : open_) ::shutdown(socket, SHUT_RDWR);
    }
    ::shutdown(listening_, SHUT_RDWR);
    accepting_.join();
    ::close(listening_);
    for (std::thread& thread : threads_) thread.join();
  }
  ScriptedServer(const ScriptedServer&) = delete;
  ScriptedServer& operator=(const ScriptedServer&) = delete;

  int port() const { return port_; }
  std::string url(const std::string& path = "/made") const {
    return "http://127.0.0.1:" + std::to_string(port_) + path;
  }
  void setScript(Script script) {
    const std::lock_guard lock(mutex_);
    script_ = std::move(script);
  }
  /// All requests so far, in the order in which they came.
  std::vector<Request> requests() const {
    const std::lock_guard lock(mutex_);
    return requests_;
  }
  uint64_t bytesSent() const {
    const std::lock_guard lock(mutex_);
    return bytesSent_;
  }

  static Reply reply(int status, const std::string& fields, const std::string& body) {
    return {"HTTP/1.1 " + std::to_string(status) + " Said\r\nContent-Length: " + std::to_string(body.size()) +
            "\r\n" + fields + "\r\n" + body};
  }
  /// What an honest server answers: the file, or its range. `fields` are lines with their ends.
  static Reply honest(const Request& request, const std::string& file, const std::string& fields = "") {
    const std::string range = request.field("range");
    if (range.empty()) return reply(200, fields, file);
    char* end = nullptr;
    const size_t first = std::strtoull(range.c_str() + 6, &end, 10);
    const size_t last =
        std::min(std::strtoull(end + 1, nullptr, 10), static_cast<unsigned long long>(file.size() - 1));
    const std::string where =
        std::to_string(first) + "-" + std::to_string(last) + "/" + std::to_string(file.size());
    if (first >= file.size()) return reply(416, "", "");
    return reply(206, fields + "Content-Range: bytes " + where + "\r\n",
                 file.substr(first, last + 1 - first));
  }

 private:
  void acceptInThread() {
    for (;;) {
      const int socket = ::accept4(listening_, nullptr, nullptr, SOCK_CLOEXEC);
      const std::lock_guard lock(mutex_);
      if (socket < 0 || ended_) {
        if (socket >= 0) ::close(socket);
        return;
      }
      open_.push_back(socket);
      threads_.emplace_back([this, socket] { talkInThread(socket); });
    }
  }

  void talkInThread(int socket) {
    std::string read;
    for (bool goesOn = true; goesOn;) {
      size_t end = 0;
      while ((end = read.find("\r\n\r\n")) == std::string::npos) {
        char bytes[4096];
        const ssize_t count = ::recv(socket, bytes, sizeof(bytes), 0);
        if (count <= 0) break;
        read.append(bytes, static_cast<size_t>(count));
      }
      if (end == std::string::npos) break;
      const Request request = parse(read.substr(0, end + 2));
      read.erase(0, end + 4);
      Script script;
      {
        const std::lock_guard lock(mutex_);
        requests_.push_back(request);
        script = script_;
      }
      goesOn = send(socket, script(request));
    }
    const std::lock_guard lock(mutex_);
    open_.erase(std::find(open_.begin(), open_.end(), socket));
    ::close(socket);
  }

  bool send(int socket, const Reply& reply) {
    std::string bytes = reply.bytes;
    for (;;) {
      std::string_view left = bytes;
      while (!left.empty()) {
        const ssize_t count = ::send(socket, left.data(), left.size(), MSG_NOSIGNAL);
        if (count <= 0) return false;
        left.remove_prefix(static_cast<size_t>(count));
        const std::lock_guard lock(mutex_);
        bytesSent_ += static_cast<uint64_t>(count);
      }
      if (!reply.endless) break;
      bytes.assign(65536, reply.bytes.back());
    }
    if (reply.hangs) {
      char byte = 0;
      while (::recv(socket, &byte, 1, 0) > 0) {
      }
      return false;
    }
    if (reply.resets) {
      const linger now{1, 0};
      ::setsockopt(socket, SOL_SOCKET, SO_LINGER, &now, sizeof(now));
    }
    return !reply.closes && !reply.resets;
  }

  static Request parse(const std::string& head) {
    Request request;
    const size_t from = head.find(' ') + 1;
    request.target = head.substr(from, head.find(' ', from) - from);
    for (size_t at = head.find("\r\n") + 2; at < head.size();) {
      const size_t stop = head.find("\r\n", at), colon = head.find(": ", at);
      std::string name = head.substr(at, colon - at);
      std::transform(name.begin(), name.end(), name.begin(),
                     [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
      request.fields[name] = head.substr(colon + 2, stop - colon - 2);
      at = stop + 2;
    }
    return request;
  }

  int listening_ = -1;
  int port_ = 0;
  mutable std::mutex mutex_;
  Script script_;
  bool ended_ = false;
  std::vector<int> open_;
  std::vector<std::thread> threads_;
  std::vector<Request> requests_;
  uint64_t bytesSent_ = 0;
  std::thread accepting_;
};

}  // namespace terrane

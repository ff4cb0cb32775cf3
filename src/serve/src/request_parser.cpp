#include "request_parser.h"

#include <algorithm>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/string_body.hpp>

namespace terrane::serve {
namespace {

namespace http = boost::beast::http;
using boost::system::error_code;
using Parser = http::request_parser<http::string_body>;

std::string_view view(boost::beast::string_view text) {
  return {text.data(), text.size()};
}

/// What Beast's parser lets pass and a careful server does not.
std::optional<HttpResponse> refusalOf(const Parser::value_type& message) {
  const auto coding = message.find(http::field::transfer_encoding);
  const auto length = view(message[http::field::content_length]);
  if (message.count(http::field::content_length) > 1) return refuse(400, "More than one Content-Length.");
  if (length.find_first_not_of("0123456789") != std::string_view::npos)
    return refuse(400, "The Content-Length is no number.");
  if (coding != message.end()) {
    if (!length.empty()) return refuse(400, "Both Content-Length and Transfer-Encoding.");
    if (message.version() < 11) return refuse(400, "Transfer-Encoding in HTTP/1.0.");
    // RFC 9112 (6.3) allows this. What is parsed by nobody can be read in two ways by nobody.
    return refuse(411, "Send the body with a Content-Length, not in chunks.");
  }
  const size_t hosts = message.count(http::field::host);
  if (hosts > 1 || (hosts == 0 && message.version() >= 11))
    return refuse(400, "There must be one Host field.");
  const auto expect = message[http::field::expect];
  if (!expect.empty() && !boost::beast::iequals(expect, "100-continue"))
    return refuse(417, "The only expectation here is 100-continue.");
  return {};
}

HttpResponse refusalOf(error_code error) {
  if (error == http::error::header_limit) return refuse(431, "The request's header fields are too large.");
  if (error == http::error::body_limit) return refuse(413, "The request's body is too large.");
  if (error == http::error::bad_version) return refuse(505, "This server speaks HTTP/1.1.");
  return refuse(400, "This is no HTTP/1.1 request: " + error.message() + ".");
}

}  // namespace

struct RequestParser::State {
  explicit State(const ServerLimits& given) : limits(given) {}
  const ServerLimits& limits;
  std::optional<Parser> parser;
  size_t headTaken = 0;  ///< bytes of an unfinished head
  bool hasHead = false;
  std::optional<HttpResponse> refusal;
};

RequestParser::RequestParser(const ServerLimits& limits) : state_(std::make_unique<State>(limits)) {
  reset();
}
RequestParser::~RequestParser() = default;

void RequestParser::reset() {
  State& s = *state_;
  s.parser.emplace();
  s.parser->header_limit(static_cast<std::uint32_t>(s.limits.headBytes));
  s.parser->body_limit(s.limits.bodyBytes);
  // note: not eager, so that no byte of a body is looked at before its head is.
  s.parser->eager(false);
  s.headTaken = 0;
  s.hasHead = false;
  s.refusal.reset();
}

size_t RequestParser::take(std::string_view bytes) {
  State& s = *state_;
  // An overlong first line has a status of its own.
  if (s.headTaken == 0 && !s.hasHead && bytes.size() >= s.limits.requestLineBytes &&
      bytes.substr(0, s.limits.requestLineBytes).find('\n') == std::string_view::npos) {
    s.refusal = refuse(414, "The request's first line is too long; send long lists of points by POST.");
    return 0;
  }
  error_code error;
  size_t taken = 0;
  while (taken < bytes.size() && !s.parser->is_done()) {
    const size_t count =
        s.parser->put(boost::asio::const_buffer(bytes.data() + taken, bytes.size() - taken), error);
    taken += count;
    if (s.parser->is_header_done() && !s.hasHead) {
      s.hasHead = true;
      s.refusal = refusalOf(s.parser->get());
      if (s.refusal) return taken;
      s.parser->eager(true);
    }
    if (error || count == 0) break;
  }
  if (error && error != http::error::need_more) {
    s.refusal = refusalOf(error);
    return taken;
  }
  // note: the parser takes fields as they come and does not add them up.
  if (!s.hasHead) s.headTaken += taken;
  const size_t left = bytes.size() - taken;
  if (!s.hasHead && s.headTaken + left >= s.limits.headBytes) {
    s.refusal = refuse(431, "The request's header fields are too large.");
  }
  return taken;
}

std::optional<HttpResponse> RequestParser::takeRefusal() {
  return std::exchange(state_->refusal, std::nullopt);
}
bool RequestParser::hasBegun() const {
  return state_->headTaken > 0 || state_->hasHead;
}
bool RequestParser::hasHead() const {
  return state_->hasHead;
}
bool RequestParser::isWhole() const {
  return state_->parser->is_done();
}
bool RequestParser::expectsContinue() const {
  return state_->hasHead && !state_->parser->get()[http::field::expect].empty();
}
bool RequestParser::keepsAlive() const {
  return state_->hasHead && state_->parser->keep_alive();
}
bool RequestParser::isOld() const {
  return state_->hasHead && state_->parser->get().version() < 11;
}

HttpRequest RequestParser::request() const {
  HttpRequest out;
  if (!state_->hasHead) return out;
  const auto& message = state_->parser->get();
  out.method = view(message.method_string());
  out.target = view(message.target());
  out.body = message.body();
  out.range = view(message[http::field::range]);
  out.ifRange = view(message[http::field::if_range]);
  out.ifMatch = view(message[http::field::if_match]);
  out.ifNoneMatch = view(message[http::field::if_none_match]);
  out.acceptEncoding = view(message[http::field::accept_encoding]);
  out.contentType = view(message[http::field::content_type]);
  out.origin = view(message[http::field::origin]);
  out.host = view(message[http::field::host]);
  out.forwardedProto = view(message["X-Forwarded-Proto"]);
  return out;
}

}  // namespace terrane::serve

#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace terrane::serve {

/// An answer as it came over the line.
struct ClientAnswer {
  int status = 0;
  std::map<std::string, std::string> fields;
  std::string body;
};

/// A client that sends what it is told, byte by byte if need be. Nothing waits longer than a deadline.
class HttpClient {
 public:
  explicit HttpClient(int port, int receiveBufferBytes = 0)
      : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    if (receiveBufferBytes > 0)
      ::setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &receiveBufferBytes, sizeof(receiveBufferBytes));
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    connected_ = ::connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof(address)) == 0;
  }
  ~HttpClient() {
    if (socket_ >= 0) ::close(socket_);
  }
  HttpClient(const HttpClient&) = delete;
  HttpClient& operator=(const HttpClient&) = delete;
  HttpClient(HttpClient&& other) noexcept
      : socket_(std::exchange(other.socket_, -1)),
        connected_(other.connected_),
        left_(std::move(other.left_)) {}

  bool connected() const { return connected_; }
  /// False where the other side is gone.
  bool send(std::string_view bytes) const {
    while (!bytes.empty()) {
      const ssize_t count = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (count <= 0) return false;
      bytes.remove_prefix(static_cast<size_t>(count));
    }
    return true;
  }
  bool sendGet(const std::string& target, const std::string& fields = "") const {
    return send("GET " + target + " HTTP/1.1\r\nHost: test\r\n" + fields + "\r\n");
  }
  /// The next answer; nothing where the connection ends or the deadline passes before it is whole.
  std::optional<ClientAnswer> receive(bool headOnly = false, double seconds = 20.0) {
    const auto deadline = endOf(seconds);
    size_t end = 0;
    while ((end = left_.find("\r\n\r\n")) == std::string::npos)
      if (!more(deadline)) return {};
    ClientAnswer answer;
    const std::string head = left_.substr(0, end + 2);
    left_.erase(0, end + 4);
    if (head.size() < 12) return {};
    answer.status = std::atoi(head.c_str() + 9);
    for (size_t at = head.find("\r\n") + 2; at < head.size();) {
      const size_t stop = head.find("\r\n", at), colon = head.find(": ", at);
      std::string& value = answer.fields[head.substr(at, colon - at)];
      value += (value.empty() ? "" : ", ") + head.substr(colon + 2, stop - colon - 2);
      at = stop + 2;
    }
    const auto length = answer.fields.find("Content-Length");
    const size_t bytes =
        headOnly || length == answer.fields.end() ? 0 : std::strtoull(length->second.c_str(), nullptr, 10);
    while (left_.size() < bytes)
      if (!more(deadline)) return {};
    answer.body = left_.substr(0, bytes);
    left_.erase(0, bytes);
    return answer;
  }
  std::optional<ClientAnswer> get(const std::string& target, const std::string& fields = "") {
    if (!sendGet(target, fields)) return {};
    return receive();
  }
  /// Does the other side close, before the deadline?
  bool closes(double seconds = 20.0) {
    const auto deadline = endOf(seconds);
    while (more(deadline)) left_.clear();
    return ended_;
  }
  /// Waits for some bytes of whatever comes.
  bool more(std::chrono::steady_clock::time_point deadline) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
    pollfd wait{socket_, POLLIN, 0};
    if (left.count() <= 0 || ::poll(&wait, 1, static_cast<int>(left.count())) <= 0) return false;
    char bytes[65536];
    const ssize_t count = ::recv(socket_, bytes, sizeof(bytes), 0);
    if (count <= 0) {
      ended_ = true;
      return false;
    }
    left_.append(bytes, static_cast<size_t>(count));
    return true;
  }
  size_t received() const { return left_.size(); }

  static std::chrono::steady_clock::time_point endOf(double seconds) {
    return std::chrono::steady_clock::now() +
           std::chrono::milliseconds(static_cast<int64_t>(seconds * 1000.0));
  }

 private:
  int socket_ = -1;
  bool connected_ = false;
  bool ended_ = false;
  std::string left_;
};

}  // namespace terrane::serve

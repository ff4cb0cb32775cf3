#include <unistd.h>

#include <cstdlib>
#include <filesystem>

#include "http_client.h"
#include "http_dataset.h"

/// A dataset as plain files behind Debian's nginx.
namespace terrane {
namespace {

/// nginx over a folder, by http and https, with a configuration that compresses what it may.
class Nginx {
 public:
  explicit Nginx(const TemporaryDirectory& folder) : certificate_(folder.file("certificate.pem")) {
    // note: nginx takes no port 0.
    port_ = freePort();
    do securePort_ = freePort();
    while (securePort_ == port_);
    const std::string key = folder.file("key.pem");
    EXPECT_EQ(Program({"req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes",
                       "-days", "2", "-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost",
                       "-keyout", key, "-out", certificate_},
                      Program::Hears::Output, "/usr/bin/openssl")
                  .wait(),
              0);
    const std::string root = std::filesystem::path(folder.file("x")).parent_path().string();
    std::string text =
        "daemon off; pid " + folder.file("nginx.pid") + "; error_log " + folder.file("nginx.log") + ";\n";
    if (::geteuid() == 0) text += "user root;\n";
    text += "events {} http { access_log off; gzip on; gzip_types *; gzip_min_length 1; gzip_proxied any;\n";
    for (const char* kind : {"client_body", "proxy", "fastcgi", "uwsgi", "scgi"})
      text += std::string(kind) + "_temp_path " + folder.file("temp") + ";\n";
    text += "server { listen 127.0.0.1:" + std::to_string(port_) +
            "; listen 127.0.0.1:" + std::to_string(securePort_) +
            " ssl http2; server_name localhost; ssl_certificate " + certificate_ + "; ssl_certificate_key " +
            key + "; root " + root + ";\n" +
            "  location ~ ^/old/(.*) { return 302 /made.terrane/$1$is_args$args; } } }\n";
    writeWholeFile(folder.file("nginx.conf"), text);
    program_ = std::make_unique<Program>(
        std::vector<std::string>{"-e", folder.file("nginx.log"), "-p", root, "-c", folder.file("nginx.conf")},
        Program::Hears::Output, TERRANE_NGINX);
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (!serve::HttpClient(port_).connected() && !program_->hasEnded() &&
           std::chrono::steady_clock::now() < deadline)
      std::this_thread::yield();
    EXPECT_FALSE(program_->hasEnded()) << readWholeFile(folder.file("nginx.log"));
  }
  ~Nginx() {
    program_->signal(SIGTERM);
    program_->wait();
  }
  Nginx(const Nginx&) = delete;
  Nginx& operator=(const Nginx&) = delete;

  std::string url(const std::string& path) const {
    return "http://127.0.0.1:" + std::to_string(port_) + path;
  }
  std::string secureUrl(const std::string& path) const {
    return "https://localhost:" + std::to_string(securePort_) + path;
  }
  const std::string& certificate() const { return certificate_; }

 private:
  static int freePort() {
    const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t length = sizeof(address);
    EXPECT_EQ(::bind(socket, reinterpret_cast<sockaddr*>(&address), length), 0);
    EXPECT_EQ(::getsockname(socket, reinterpret_cast<sockaddr*>(&address), &length), 0);
    ::close(socket);
    return ntohs(address.sin_port);
  }

  int port_ = 0;
  int securePort_ = 0;
  std::string certificate_;
  std::unique_ptr<Program> program_;
};

class NginxJourney : public HttpDatasetTest {};

TEST_F(NginxJourney, FilesTilesAndPicturesAreThoseOfTheDirectory) {
  const Nginx nginx(*folder_);
  expectFiles(nginx.url("/made.terrane"));
  expectTiles(nginx.url("/made.terrane"));
  expectPicture(nginx.url("/made.terrane"));
  // Where it has moved, each file says so.
  expectTiles(nginx.url("/old"));
}

TEST_F(NginxJourney, CertificatesAreChecked) {
  const Nginx nginx(*folder_);
  const auto distrusted = openDataset(nginx.secureUrl("/made.terrane"));
  ASSERT_FALSE(distrusted.ok());
  EXPECT_NE(distrusted.error().message.find("certificate"), std::string::npos) << distrusted.error().message;
  ASSERT_EQ(::setenv("CURL_CA_BUNDLE", nginx.certificate().c_str(), 1), 0);
  expectFiles(nginx.secureUrl("/made.terrane"));
  expectTiles(nginx.secureUrl("/made.terrane"));
  expectPicture(nginx.secureUrl("/made.terrane"));
  ASSERT_EQ(::unsetenv("CURL_CA_BUNDLE"), 0);
}

TEST_F(NginxJourney, ADatasetThatIsBuiltAgainMeanwhileIsNotMixed) {
  namespace fs = std::filesystem;
  const Nginx nginx(*folder_);
  const std::string copy = folder_->file("copy.terrane");
  fs::copy(directory(), copy, fs::copy_options::recursive);
  const auto remote = openDataset(nginx.url("/copy.terrane"));
  ASSERT_TRUE(remote.ok()) << remote.error().message;
  ASSERT_TRUE(remote->readElevation(TileId{}).ok());
  const std::vector<TileId> tiles = remote->elevationTiles();
  ASSERT_EQ(Program({"build", folder_->file("made.tif"), "--imagery", folder_->file("color.tif"), "-o", copy,
                     "-q", "--overwrite", "--max-error", "3"})
                .wait(),
            0);
  const auto mixed = remote->readElevation(tiles);
  ASSERT_FALSE(mixed.ok());
  EXPECT_NE(mixed.error().message.find("another build"), std::string::npos) << mixed.error().message;
  EXPECT_TRUE(openDataset(nginx.url("/copy.terrane")).ok());
}

}  // namespace
}  // namespace terrane

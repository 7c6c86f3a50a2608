#include "services/gateway/http_listener.h"

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/strand.hpp>
#include <filesystem>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

#include "services/gateway/http_connection.h"
#include "services/runtime/log.h"

namespace sixpoint::gateway {
namespace {

using Secured = asio::ssl::stream<tcp::socket>;

// "127.0.0.1:7480", "[::1]:7480"
absl::StatusOr<tcp::endpoint> EndpointOf(const std::string& text) {
  const absl::Status refusal = Refuse("listen", text, "a host of this computer and a port, such as 127.0.0.1:7480");
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos) return refusal;
  std::string host = text.substr(0, colon);
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  error_code error;
  asio::ip::address address = asio::ip::make_address(host, error);
  if (error && !host.empty()) {
    asio::io_context io;
    const auto found = tcp::resolver(io).resolve(host, "", tcp::resolver::passive, error);
    if (!error && !found.empty()) address = found.begin()->endpoint().address();
  }
  const std::string port = text.substr(colon + 1);
  if (error || port.empty() || port.size() > 5 || port.find_first_not_of("0123456789") != std::string::npos)
    return refusal;
  const int number = std::stoi(port);
  if (number > 65535) return refusal;
  return tcp::endpoint(address, static_cast<unsigned short>(number));
}

absl::StatusOr<std::unique_ptr<asio::ssl::context>> TlsOf(const HttpOptions& options) {
  if (options.certificate_file.empty()) return nullptr;
  auto context = std::make_unique<asio::ssl::context>(asio::ssl::context::tls_server);
  SSL_CTX_set_min_proto_version(context->native_handle(), TLS1_2_VERSION);
  // Renegotiation and compression are of the past; a session is resumed by ticket alone.
  SSL_CTX_set_options(context->native_handle(), SSL_OP_NO_RENEGOTIATION | SSL_OP_NO_COMPRESSION);
  error_code error;
  context->use_certificate_chain_file(options.certificate_file, error);
  if (error) return Refuse("tls_certificate", options.certificate_file + " (" + error.message() + ")", "PEM");
  context->use_private_key_file(options.key_file, asio::ssl::context::pem, error);
  if (error) return Refuse("tls_key", options.key_file + " (" + error.message() + ")", "the certificate's key, PEM");
  return context;
}

}  // namespace

ClientPlace PlaceOf(const HttpOptions& options, const tcp::endpoint& peer, bool is_tls, const Exchange::Head& head) {
  ClientPlace place{peer.address().to_string(), is_tls};
  if (!options.behind_proxy || !peer.address().is_loopback()) return place;
  // The last one is the proxy's own word; those before came from outside.
  const std::string forwarded = HeaderOf(head, "X-Forwarded-For");
  std::string last = forwarded.substr(forwarded.rfind(',') == std::string::npos ? 0 : forwarded.rfind(',') + 1);
  last.erase(0, last.find_first_not_of(' '));
  error_code error;
  if (const auto address = asio::ip::make_address(last, error); !error) place.address = address.to_string();
  place.is_encrypted = HeaderOf(head, "X-Forwarded-Proto") == "https";
  return place;
}

std::string BadRequestText(const std::string& message) {
  return nlohmann::json{{"code", "invalid_argument"}, {"message", "request: " + message + ", want HTTP/1.1"}}.dump();
}

// What runs in io_ knows it without keeping it: it goes last, with whatever waits in it still.
class HttpListener::State {
 public:
  State(HttpOptions options, Handle handle, std::unique_ptr<asio::ssl::context> tls)
      : shared_(std::make_shared<HttpShared>()), tls_(std::move(tls)), acceptor_(asio::make_strand(io_)) {
    shared_->options = std::move(options);
    shared_->handle = std::move(handle);
  }

  absl::Status Listen(const tcp::endpoint& endpoint) {
    error_code error;
    acceptor_.open(endpoint.protocol(), error);
    if (!error) acceptor_.set_option(tcp::acceptor::reuse_address(true), error);
    if (!error) acceptor_.bind(endpoint, error);
    if (!error) acceptor_.listen(asio::socket_base::max_listen_connections, error);
    if (!error) return absl::OkStatus();
    return absl::UnavailableError("listen: " + shared_->options.address + ": " + error.message());
  }
  int port() const { return acceptor_.local_endpoint().port(); }

  void Run(int threads) {
    asio::co_spawn(
        acceptor_.get_executor(), [this] { return Accept(); }, asio::detached);
    std::vector<std::thread> others;
    for (int i = 1; i < threads; ++i) others.emplace_back([this] { io_.run(); });
    io_.run();
    for (std::thread& each : others) each.join();
  }

  void Stop(std::chrono::milliseconds patience) {
    shared_->is_stopping = true;
    asio::post(acceptor_.get_executor(), [this] {
      error_code ignored;
      acceptor_.close(ignored);
    });
    const auto until = std::chrono::steady_clock::now() + patience;
    while (std::chrono::steady_clock::now() < until && CloseIdle() > 0)
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    io_.stop();
  }

 private:
  Awaitable<void> Accept() {
    while (acceptor_.is_open()) {
      tcp::socket socket{asio::make_strand(io_)};
      error_code error;
      co_await acceptor_.async_accept(socket, asio::redirect_error(asio::use_awaitable, error));
      if (!error) {
        Take(std::move(socket));
        continue;
      }
      if (error == asio::error::operation_aborted) co_return;
      // Without a descriptor left it would be asked again at once, for ever.
      asio::steady_timer pause(acceptor_.get_executor(), std::chrono::milliseconds(100));
      co_await pause.async_wait(asio::redirect_error(asio::use_awaitable, error));
    }
  }

  void Take(tcp::socket socket) {
    error_code error;
    const tcp::endpoint peer = socket.remote_endpoint(error);
    if (error) return;
    socket.set_option(tcp::no_delay(true), error);
    const std::string address = peer.address().to_string();
    const bool is_proxy = shared_->options.behind_proxy && peer.address().is_loopback();
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      int& held = of_address_[address];
      const bool is_too_many =
          !is_proxy && static_cast<std::size_t>(held) >= shared_->options.connections_of_one_address;
      if (is_too_many || closers_.size() >= shared_->options.connections) {
        if (held == 0) of_address_.erase(address);
        return;  // closed
      }
      ++held;
    }
    if (tls_ == nullptr)
      Begin(std::make_shared<HttpConnection<tcp::socket>>(shared_, std::move(socket), peer), address);
    else
      Begin(std::make_shared<HttpConnection<Secured>>(shared_, Secured(std::move(socket), NewestTls()), peer), address);
  }

  // A renewed certificate counts for the next connection; those that stand keep theirs, which OpenSSL counts.
  asio::ssl::context& NewestTls() {
    const auto now = std::chrono::steady_clock::now();
    if (now < look_again_) return *tls_;
    look_again_ = now + std::chrono::seconds(1);
    std::error_code error;
    const auto written = std::filesystem::last_write_time(shared_->options.certificate_file, error);
    if (error || written == tls_written_) return *tls_;
    absl::StatusOr<std::unique_ptr<asio::ssl::context>> renewed = TlsOf(shared_->options);
    if (renewed.ok())
      tls_ = *std::move(renewed);
    else
      runtime::Log(runtime::LogLevel::kError, std::string(renewed.status().message()));
    tls_written_ = written;
    return *tls_;
  }

  template <typename Connection>
  void Begin(std::shared_ptr<Connection> connection, const std::string& address) {
    const auto executor = connection->executor();
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      closers_[connection.get()] = [executor, weak = std::weak_ptr<Connection>(connection)] {
        asio::post(executor, [weak] {
          if (const auto strong = weak.lock()) strong->CloseIfIdle();
        });
      };
    }
    asio::co_spawn(
        executor, [connection] { return connection->Run(); },
        [this, key = static_cast<void*>(connection.get()), address](std::exception_ptr thrown) {
          Forget(key, address);
          try {
            if (thrown) std::rethrow_exception(thrown);
          } catch (const std::exception& error) {
            runtime::Log(runtime::LogLevel::kError, std::string("a connection ended: ") + error.what());
          }
        });
  }

  void Forget(void* key, const std::string& address) {
    const std::lock_guard<std::mutex> lock(mutex_);
    closers_.erase(key);
    if (const auto held = of_address_.find(address); --held->second == 0) of_address_.erase(held);
  }

  // How many connections there are still.
  std::size_t CloseIdle() {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (const auto& [key, close] : closers_) close();
    return closers_.size();
  }

  asio::io_context io_;
  const std::shared_ptr<HttpShared> shared_;
  // Of the acceptor's strand.
  std::unique_ptr<asio::ssl::context> tls_;
  std::filesystem::file_time_type tls_written_{};
  std::chrono::steady_clock::time_point look_again_{};
  tcp::acceptor acceptor_;
  std::mutex mutex_;
  std::map<void*, std::function<void()>> closers_;
  std::map<std::string, int> of_address_;
};

absl::StatusOr<std::unique_ptr<HttpListener>> HttpListener::Open(const HttpOptions& options, Handle handle) {
  const absl::StatusOr<tcp::endpoint> endpoint = EndpointOf(options.address);
  if (!endpoint.ok()) return endpoint.status();
  absl::StatusOr<std::unique_ptr<asio::ssl::context>> tls = TlsOf(options);
  if (!tls.ok()) return tls.status();
  if (*tls == nullptr && !endpoint->address().is_loopback())
    return Refuse(
        "listen", options.address,
        "a loopback address behind a proxy that speaks TLS (deploy/nginx), or --tls-certificate and --tls-key");
  auto state = std::make_unique<State>(options, std::move(handle), *std::move(tls));
  if (absl::Status listens = state->Listen(*endpoint); !listens.ok()) return listens;
  return std::unique_ptr<HttpListener>(new HttpListener(std::move(state)));
}

HttpListener::HttpListener(std::unique_ptr<State> state) : state_(std::move(state)) {}
HttpListener::~HttpListener() = default;
int HttpListener::port() const { return state_->port(); }
void HttpListener::Run(int threads) { state_->Run(threads); }
void HttpListener::Stop(std::chrono::milliseconds patience) { state_->Stop(patience); }

}  // namespace sixpoint::gateway

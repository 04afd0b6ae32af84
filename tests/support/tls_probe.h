// The same client as HttpProbe, through TLS. It believes one certificate only, for the name cell.test.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl.hpp>
#include <filesystem>
#include <memory>
#include <string>

#include "tests/support/http_probe.h"

namespace veneer::testing {

class TlsProbe {
 public:
  TlsProbe(int port, const std::filesystem::path& certificate) : state_(std::make_unique<State>()) {
    State& s = *state_;
    s.context.load_verify_file(certificate.string());
    s.context.set_verify_mode(boost::asio::ssl::verify_peer);
    s.stream = std::make_unique<Stream>(s.loop, s.context);
    s.stream->set_verify_callback(boost::asio::ssl::host_name_verification("cell.test"));
    boost::system::error_code fault;
    s.stream->next_layer().connect({boost::asio::ip::address_v4::loopback(), static_cast<unsigned short>(port)}, fault);
    if (!fault) s.stream->handshake(boost::asio::ssl::stream_base::client, fault);
    s.connected = !fault;
  }
  bool connected() const { return state_->connected; }

  void send(const std::string& bytes) {
    boost::system::error_code fault;
    boost::asio::write(*state_->stream, boost::asio::buffer(bytes), fault);
  }
  HttpProbe::Answer read() {
    HttpProbe::Answer answer;
    boost::beast::http::response_parser<boost::beast::http::string_body> parser;
    parser.body_limit(std::numeric_limits<std::uint64_t>::max());
    boost::system::error_code fault;
    boost::beast::http::read(*state_->stream, state_->buffer, parser, fault);
    if (fault) return answer;
    answer.message = parser.release();
    answer.status = static_cast<int>(answer.message.result_int());
    answer.body = answer.message.body();
    return answer;
  }
  HttpProbe::Answer ask(const std::string& bytes) {
    send(bytes);
    return read();
  }
  // Waits until nothing more comes: because the other end hung up?
  bool hung_up() {
    namespace error = boost::asio::error;
    char byte = 0;
    boost::system::error_code fault;
    while (!fault) state_->stream->read_some(boost::asio::buffer(&byte, 1), fault);
    return fault == error::eof || fault == boost::asio::ssl::error::stream_truncated ||
           fault == error::connection_reset;
  }

 private:
  using Stream = boost::asio::ssl::stream<boost::asio::ip::tcp::socket>;
  struct State {
    boost::asio::io_context loop;
    boost::asio::ssl::context context{boost::asio::ssl::context::tls_client};
    std::unique_ptr<Stream> stream;
    boost::beast::flat_buffer buffer;
    bool connected = false;
  };
  std::unique_ptr<State> state_;
};

}  // namespace veneer::testing

// A client that says exactly the bytes it is told, for what a proper client would never send.
#pragma once

#include <boost/asio/buffer.hpp>
#include <boost/asio/connect.hpp>
#include <boost/asio/generic/stream_protocol.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/string_body.hpp>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

namespace veneer::testing {

class HttpProbe {
 public:
  using Socket = boost::asio::generic::stream_protocol::socket;

  static HttpProbe over_unix(const std::string& path) {
    HttpProbe probe;
    probe.socket_.connect(boost::asio::local::stream_protocol::endpoint(path));
    return probe;
  }
  static HttpProbe over_tcp(int port) {
    HttpProbe probe;
    probe.socket_.connect(
        boost::asio::ip::tcp::endpoint(boost::asio::ip::address_v4::loopback(), static_cast<unsigned short>(port)));
    return probe;
  }

  // False when the other end hung up before it had all.
  bool send(const std::string& bytes) {
    boost::system::error_code fault;
    boost::asio::write(socket_, boost::asio::buffer(bytes), fault);
    return !fault;
  }

  struct Answer {
    int status = 0;  // 0: hung up without an answer
    std::string body;
    boost::beast::http::response<boost::beast::http::string_body> message;
    std::string code() const {
      const auto json = nlohmann::json::parse(body, nullptr, false);
      const auto error = json.is_object() ? json.value("error", nlohmann::json::object()) : nlohmann::json::object();
      return error.value("code", "");
    }
    std::string header(const std::string& name) const { return std::string(message[name]); }
  };
  Answer read() {
    Answer answer;
    boost::beast::http::response_parser<boost::beast::http::string_body> parser;
    parser.body_limit(std::numeric_limits<std::uint64_t>::max());
    boost::system::error_code fault;
    boost::beast::http::read(socket_, buffer_, parser, fault);
    if (fault) return answer;
    answer.message = parser.release();
    answer.status = static_cast<int>(answer.message.result_int());
    answer.body = answer.message.body();
    return answer;
  }
  Answer ask(const std::string& bytes) {
    send(bytes);
    return read();
  }
  // So many bytes of whatever comes; fewer when the other end hung up.
  std::size_t read_bytes(std::size_t count) {
    std::string bytes(count, 0);
    boost::system::error_code fault;
    return boost::asio::read(socket_, boost::asio::buffer(bytes), fault);
  }
  bool hung_up() {
    char byte = 0;
    boost::system::error_code fault;
    socket_.read_some(boost::asio::buffer(&byte, 1), fault);
    return static_cast<bool>(fault);
  }

 private:
  HttpProbe() : loop_(std::make_unique<boost::asio::io_context>()), socket_(*loop_) {}
  std::unique_ptr<boost::asio::io_context> loop_;
  Socket socket_;
  boost::beast::flat_buffer buffer_;
};

}  // namespace veneer::testing

// A client of the event stream over TCP, anonymous or with a console's session.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/field.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <nlohmann/json.hpp>
#include <string>

namespace veneer::testing {

class EventListener {
 public:
  // `receive_buffer` 0: as large as the kernel likes.
  explicit EventListener(int port, const std::string& session = "", int receive_buffer = 0,
                         const std::string& query = "")
      : socket_(loop_) {
    namespace websocket = boost::beast::websocket;
    const Tcp::endpoint door(boost::asio::ip::address_v4::loopback(), static_cast<unsigned short>(port));
    socket_.next_layer().open(door.protocol());
    if (receive_buffer > 0) socket_.next_layer().set_option(Tcp::socket::receive_buffer_size(receive_buffer));
    socket_.next_layer().connect(door);
    socket_.read_message_max(0);
    if (!session.empty())
      socket_.set_option(websocket::stream_base::decorator([session](websocket::request_type& request) {
        request.set(boost::beast::http::field::sec_websocket_protocol, "veneer.events, bearer." + session);
      }));
    socket_.handshake("127.0.0.1:" + std::to_string(port), "/api/v1/events" + query);
  }
  // Null when the stream has ended; reason() then says why.
  nlohmann::json next() {
    boost::beast::flat_buffer buffer;
    boost::system::error_code fault;
    socket_.read(buffer, fault);
    if (fault) return nullptr;
    return nlohmann::json::parse(boost::beast::buffers_to_string(buffer.data()));
  }
  std::string reason() const { return std::string(socket_.reason().reason.c_str()); }
  void go_away() { socket_.next_layer().close(); }
  // From another thread: next() ends.
  void end() {
    boost::system::error_code ignored;
    socket_.next_layer().shutdown(Tcp::socket::shutdown_both, ignored);
  }
  void say(const std::string& text) {
    boost::system::error_code ignored;
    socket_.write(boost::asio::buffer(text), ignored);
  }

 private:
  using Tcp = boost::asio::ip::tcp;
  boost::asio::io_context loop_;
  boost::beast::websocket::stream<Tcp::socket> socket_;
};

}  // namespace veneer::testing

#include "daemon/threads/reactor_timer.h"

#include <boost/asio/steady_timer.hpp>
#include <utility>

namespace veneer::daemon {
namespace {

class ReactorTimer final : public OneShotTimer {
 public:
  explicit ReactorTimer(boost::asio::io_context& reactor) : timer_(reactor) {}
  void after(Duration delay, std::function<void()> then) override {
    timer_.expires_after(delay);
    timer_.async_wait([then = std::move(then)](boost::system::error_code fault) {
      if (!fault) then();
    });
  }
  void cancel() override { timer_.cancel(); }

 private:
  boost::asio::steady_timer timer_;
};

}  // namespace

std::unique_ptr<OneShotTimer> make_reactor_timer(boost::asio::io_context& reactor) {
  return std::make_unique<ReactorTimer>(reactor);
}

Repeater::Repeater(std::unique_ptr<OneShotTimer> timer, Duration period, std::function<void()> act)
    : timer_(std::move(timer)), period_(period), act_(std::move(act)) {}

void Repeater::begin() {
  timer_->after(period_, [this] {
    act_();
    begin();
  });
}

}  // namespace veneer::daemon

#include "drivers/sim/lihuiyu_board/usb_host.h"

#include <algorithm>
#include <utility>

namespace veneer::sim {

void UsbHost::submit(HostTransfer transfer, TimePoint now) {
  queue_.push_back(std::move(transfer));
  if (!under_way_) begin(now);
}

void UsbHost::cancel_all() {
  if (under_way_) board_.transfer_given_up();
  under_way_ = false;
  queue_.clear();
}

void UsbHost::cancel(std::uint64_t id) {
  if (under_way_ && queue_.front().id == id) board_.transfer_given_up();
  under_way_ = under_way_ && queue_.front().id != id;
  std::erase_if(queue_, [id](const HostTransfer& t) { return t.id == id; });
}

void UsbHost::reopen() {
  cancel_all();
  replies_.clear();
  enumeration_ = board_.enumeration();
}

void UsbHost::begin(TimePoint now) {
  under_way_ = !queue_.empty();
  if (!under_way_) return;
  first_try_ = now + transfer_time_;
  deadline_ = now + queue_.front().timeout;
}

void UsbHost::advance_to(TimePoint now) {
  // From event to event, so that each transfer meets the board as it is at that moment.
  for (;;) {
    const auto next = next_event_time();
    const TimePoint until = next ? std::min(*next, now) : now;
    board_.advance_to(until);
    if (!under_way_ && !queue_.empty()) begin(until);
    if (under_way_ && until >= first_try_ && attempt(until)) {
      begin(until);
      continue;
    }
    if (until >= now) return;
  }
}

std::optional<TimePoint> UsbHost::next_event_time() const {
  std::optional<TimePoint> next = board_.next_event_time();
  if (!under_way_) return next;
  const TimePoint mine = board_.advanced_to() < first_try_ ? first_try_ : deadline_;
  return next ? std::min(*next, mine) : mine;
}

bool UsbHost::attempt(TimePoint now) {
  using Answer = LihuiyuBoard::Answer;
  const HostTransfer& transfer = queue_.front();
  if (gone()) {
    end(HostReply::End::kError);
    return true;
  }
  Answer answer = Answer::kNotYet;
  std::string bytes;
  if (const auto* setup = std::get_if<HostSetup>(&transfer.what)) {
    answer = board_.setup(setup->request_type, setup->request, setup->value, setup->index);
  } else if (const auto* write = std::get_if<HostWrite>(&transfer.what)) {
    answer = board_.write(write->endpoint, write->bytes, now);
  } else if (const auto* read = std::get_if<HostRead>(&transfer.what)) {
    if (auto got = board_.read(read->endpoint, read->most, now)) {
      answer = Answer::kTaken;
      bytes = std::move(*got);
    }
  }
  if (answer == Answer::kNotYet) {
    if (now < deadline_) return false;
    board_.transfer_given_up();
    end(HostReply::End::kTimedOut);
    return true;
  }
  end(answer == Answer::kTaken ? HostReply::End::kDone : HostReply::End::kError, std::move(bytes));
  return true;
}

void UsbHost::end(HostReply::End how, std::string bytes) {
  const std::uint64_t id = queue_.front().id;
  queue_.pop_front();
  under_way_ = false;
  if (id != 0) replies_.push_back({id, how, std::move(bytes)});
}

std::vector<HostReply> UsbHost::take_replies() { return std::exchange(replies_, {}); }

}  // namespace veneer::sim

#include "daemon/api/console_links.h"

#include "daemon/api/random_token.h"

namespace veneer::daemon {

Result<std::string> ConsoleLinks::new_link(const std::string& maker, Role role) {
  auto token = random_token();
  if (!token) return token.error();
  const TimePoint now = clock_.now();
  std::erase_if(links_, [now](const Secret& secret) { return secret.expires <= now; });
  if (links_.size() >= kMaxLinks) links_.erase(links_.begin());
  links_.push_back({*token, now + kLinkLife, {"console link " + std::to_string(++last_link_) + " of " + maker, role}});
  return *token;
}

Result<ConsoleLinks::Link> ConsoleLinks::redeem(std::string_view token) {
  const TimePoint now = clock_.now();
  std::erase_if(links_, [now](const Secret& secret) { return secret.expires <= now; });
  const Secret* found = nullptr;
  for (const Secret& secret : links_) {  // all of them: the time taken tells nothing
    if (equal_secrets(secret.value, token)) found = &secret;
  }
  if (!found) {
    return Error{
        ErrorCode::kRefused,
        "this console link was used already or is older than five minutes: get a new one with `veneerctl console`"};
  }
  Link link = found->link;
  links_.erase(links_.begin() + (found - links_.data()));
  return link;
}

}  // namespace veneer::daemon

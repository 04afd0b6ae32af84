#include "daemon/api/console_links.h"

#include <algorithm>

#include "daemon/api/random_token.h"

namespace veneer::daemon {

void ConsoleLinks::forget_expired(std::vector<Secret>& secrets) const {
  const TimePoint now = clock_.now();
  std::erase_if(secrets, [now](const Secret& secret) { return secret.expires <= now; });
}

const ConsoleLinks::Secret* ConsoleLinks::find(const std::vector<Secret>& secrets, std::string_view value) {
  const Secret* found = nullptr;
  for (const Secret& secret : secrets) {  // all of them: the time taken tells nothing
    if (equal_secrets(secret.value, value)) found = &secret;
  }
  return found;
}

Result<std::string> ConsoleLinks::new_link(const std::string& maker) {
  auto token = random_token();
  if (!token) return token.error();
  forget_expired(links_);
  if (links_.size() >= kMaxLinks) links_.erase(links_.begin());
  links_.push_back({*token, clock_.now() + kLinkLife, "console link " + std::to_string(++last_link_) + " of " + maker});
  return *token;
}

Result<ConsoleLinks::Session> ConsoleLinks::redeem(std::string_view token) {
  forget_expired(links_);
  const Secret* link = find(links_, token);
  if (!link) {
    return Error{
        ErrorCode::kRefused,
        "this console link was used already or is older than five minutes: get a new one with `veneerctl console`"};
  }
  auto secret = random_token();
  if (!secret) return secret.error();
  const std::string who = link->who;
  links_.erase(links_.begin() + (link - links_.data()));
  forget_expired(sessions_);
  if (sessions_.size() >= kMaxSessions) sessions_.erase(sessions_.begin());
  sessions_.push_back({*secret, clock_.now() + kSessionLife, who});
  return Session{*secret, who};
}

std::optional<std::string> ConsoleLinks::who_has(std::string_view secret) const {
  const Secret* session = find(sessions_, secret);
  if (!session || session->expires <= clock_.now()) return std::nullopt;
  return session->who;
}

}  // namespace veneer::daemon

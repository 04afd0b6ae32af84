#include "cli/command_context.h"

#include <charconv>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <utility>

#include "base/files.h"
#include "cli/colours.h"
#include "cli/json_read.h"
#include "cli/progress.h"
#include "cli/render.h"
#include "cli/sign_ins.h"
#include "cli/unknown_command.h"

namespace veneer::cli {

ApiAddress CommandContext::address() const {
  constexpr std::string_view kTls = "https://";
  ApiAddress to;
  to.authority = authority;
  const bool tls = socket.starts_with(kTls);
  const std::string where = tls ? socket.substr(kTls.size()) : socket;
  std::size_t colon = where.rfind(':');
  if (tls && (colon == std::string::npos || where.ends_with(']'))) colon = where.size();
  to.port = tls ? 443 : 0;
  const bool port = colon < where.size() &&
                    std::from_chars(where.data() + colon + 1, where.data() + where.size(), to.port).ec == std::errc();
  if (where.find('/') == std::string::npos && (tls || port)) {
    to.tls = tls;
    to.host = where.substr(0, colon);
    return to;
  }
  return {socket, "", 0};
}

ApiClient CommandContext::client(std::chrono::milliseconds patience) const {
  ApiAddress to = address();
  if (to.unix_path.empty()) to.secret = token.empty() && to.tls ? kept_secret(socket) : token;
  return ApiClient(std::move(to), patience);
}

ApiClient CommandContext::stop_client(std::chrono::milliseconds patience) const {
  ApiAddress to = address();
  if (to.unix_path.empty() && may_carry_secret(to)) to.secret = token;
  return ApiClient(std::move(to), patience);
}

void fail(const Error& error, int exit_status) {
  std::cerr << (err_has_colours() ? in_red("veneerctl:") : "veneerctl:") << ' ' << with_short_numbers(error.message)
            << std::endl;
  throw CLI::RuntimeError(exit_status);
}

void CommandContext::finish(const Result<nlohmann::json>& outcome, const Render& render, int exit_status) const {
  const auto print = [](nlohmann::json value) {
    if (!value.is_object()) value = {{"value", std::move(value)}};
    if (!value.contains("schema_version")) value["schema_version"] = 1;
    std::cout << value.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) << std::endl;
  };
  if (!outcome) {
    const Error& error = outcome.error();
    if (json) print({{"error", {{"code", to_string(error.code)}, {"message", error.message}}}});
    fail(error, exit_status);
  }
  if (json) return print(*outcome);
  const std::string text = render(*outcome);
  std::cout << (out_has_colours() ? with_colours(text) : text) << std::flush;
}

void CommandContext::finish_step(const Result<nlohmann::json>& outcome, const Render& render) const {
  constexpr std::chrono::seconds kPatience{2};  // what was asked for is done
  finish(outcome, [&](const nlohmann::json& value) {
    std::string text = render(value);
    if (text.find("veneerctl ") != std::string::npos) return text;
    const auto status = client(kPatience).get("/status");
    if (!status || !member(*status, "next_step").is_object()) return text;
    return text + "Next: " + render_next(*status);
  });
}

Result<nlohmann::json> CommandContext::run_task(const Result<nlohmann::json>& started) const {
  if (!started) return started.error();
  const std::int64_t task = whole_or(*started, "task", 0);
  if (task == 0) return started;  // it was short work and is done
  const InterruptGuard interrupt;
  Progress progress(std::cerr, Progress::style_of_stderr());
  return client().wait_task(task, [&](const nlohmann::json& view) {
    progress.show(number_or(view, "progress", 0), text_or(view, "text", ""));
    return !InterruptGuard::interrupted();
  });
}

namespace {

// What is missing may be what was mistyped; a value that is refused is not.
std::string what_is_unknown(const CLI::App& app, const CLI::ParseError& wrong) {
  if (wrong.get_exit_code() == 0) return "";
  const bool may_be_an_option = dynamic_cast<const CLI::ExtrasError*>(&wrong) != nullptr ||
                                dynamic_cast<const CLI::RequiredError*>(&wrong) != nullptr;
  const std::string option = may_be_an_option ? unknown_option(app) : "";
  return option.empty() ? unknown_command(app) : option;
}

}  // namespace

int run(CLI::App& app, int argc, char** argv) {
  app.failure_message([](const CLI::App* which, const CLI::Error& wrong) {
    return with_short_numbers(CLI::FailureMessage::simple(which, wrong));
  });
  try {
    app.parse(argc, argv);
  } catch (const CLI::RuntimeError& ended) {  // a command that failed and has said why
    return ended.get_exit_code();
  } catch (const CLI::ParseError& wrong) {  // also --help, which is no error
    if (const std::string unknown = what_is_unknown(app, wrong); !unknown.empty()) {
      std::cerr << "veneerctl: " << unknown << std::endl;
      return kUnusableArguments;
    }
    return app.exit(wrong) == 0 ? 0 : kUnusableArguments;
  }
  return 0;
}

Result<std::string> read_file(const std::string& path) {
  std::error_code fault;
  if (std::filesystem::is_directory(path, fault)) {
    return Error{ErrorCode::kInvalidArgument, path + " is a folder: give a file"};
  }
  auto bytes = read_whole(path);
  if (!bytes) {
    const bool there = std::filesystem::exists(path, fault);
    return Error{there ? ErrorCode::kInvalidArgument : ErrorCode::kNotFound,
                 there ? path + " cannot be read: check its permissions" : "there is no file " + path};
  }
  if (bytes->empty())
    return Error{ErrorCode::kInvalidArgument, path + " is empty: save it again, or name another file"};
  return *std::move(bytes);
}

Status write_file(const std::string& path, const std::string& bytes) {
  std::ofstream file(path, std::ios::binary);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  file.close();
  if (file) return Ok();
  // Asked first: without the half of it there may be room again.
  auto refused = disk_refuses(path);
  std::error_code fault;
  if (std::filesystem::is_regular_file(path, fault)) std::filesystem::remove(path, fault);
  if (refused) return *std::move(refused);
  return Error{ErrorCode::kStorage,
               "cannot write " + path + ": see that its folder is there, and that you may write into it"};
}

void save_parts(const CommandContext& context, const std::string& target, const std::vector<SavedPart>& parts) {
  for (const SavedPart& wanted : parts) {
    if (wanted.file.empty()) continue;
    const auto bytes = context.client().get_bytes(target + wanted.part);
    if (!bytes) fail(bytes.error());
    if (Status written = write_file(wanted.file, *bytes); !written) fail(written.error());
  }
}

}  // namespace veneer::cli

#include "drivers/sane/sane_library.h"

#include <fmt/format.h>
#include <sane/sane.h>
#include <sane/saneopts.h>
#include <stdlib.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstring>
#include <functional>
#include <utility>

#include "drivers/sane/patience.h"

namespace veneer::sane {
namespace {

static_assert(static_cast<int>(ScanStatus::kEnd) == SANE_STATUS_EOF);
static_assert(static_cast<int>(ScanStatus::kAccessDenied) == SANE_STATUS_ACCESS_DENIED);
// Of a later SANE, which backends give already; sane.h keeps their names from older programs.
static_assert(static_cast<int>(ScanStatus::kWarmingUp) == 12 && static_cast<int>(ScanStatus::kLocked) == 13);

ScanStatus status_of(SANE_Status status) {
  const int number = static_cast<int>(status);
  return number >= 0 && number < static_cast<int>(ScanStatus::kUnknown) ? static_cast<ScanStatus>(number)
                                                                        : ScanStatus::kUnknown;
}

std::string text_of(SANE_String_Const text) { return text == nullptr ? "" : text; }

const char* unit_of(SANE_Unit unit) {
  switch (unit) {
    case SANE_UNIT_PIXEL:
      return "px";
    case SANE_UNIT_BIT:
      return "bit";
    case SANE_UNIT_MM:
      return "mm";
    case SANE_UNIT_DPI:
      return "dpi";
    case SANE_UNIT_PERCENT:
      return "%";
    case SANE_UNIT_MICROSECOND:
      return "us";
    case SANE_UNIT_NONE:
      break;
  }
  return "";
}

constexpr SANE_Int kWordSize = sizeof(SANE_Word);
constexpr SANE_Int kLongestText = 1 << 16;

ScannerOption::Kind kind_of(const SANE_Option_Descriptor& option) {
  using Kind = ScannerOption::Kind;
  switch (option.type) {
    case SANE_TYPE_BOOL:
      return option.size == kWordSize ? Kind::kYesNo : Kind::kOther;
    case SANE_TYPE_INT:
      return option.size == kWordSize ? Kind::kWhole : Kind::kOther;
    case SANE_TYPE_FIXED:
      return option.size == kWordSize ? Kind::kNumber : Kind::kOther;
    case SANE_TYPE_STRING:
      return option.size > 0 && option.size <= kLongestText ? Kind::kText : Kind::kOther;
    default:
      return Kind::kOther;
  }
}

double number_of(const SANE_Option_Descriptor& option, SANE_Word word) {
  return option.type == SANE_TYPE_FIXED ? SANE_UNFIX(word) : static_cast<double>(word);
}

SANE_Word word_of(const SANE_Option_Descriptor& option, double number) {
  const auto word = static_cast<SANE_Word>(
      std::lround(option.type == SANE_TYPE_FIXED ? number * (1 << SANE_FIXED_SCALE_SHIFT) : number));
  // Digits are rounded for people, and the end of a range may lie a hair within them.
  if (option.constraint_type != SANE_CONSTRAINT_RANGE || option.constraint.range == nullptr) return word;
  return std::max(option.constraint.range->min, std::min(option.constraint.range->max, word));
}

void describe_constraint(const SANE_Option_Descriptor& from, ScannerOption& to) {
  if (from.constraint_type == SANE_CONSTRAINT_RANGE && from.constraint.range != nullptr) {
    const SANE_Range& range = *from.constraint.range;
    to.range = {number_of(from, range.min), number_of(from, range.max), number_of(from, range.quant)};
  }
  if (from.constraint_type == SANE_CONSTRAINT_WORD_LIST && from.constraint.word_list != nullptr)
    for (SANE_Word i = 1; i <= from.constraint.word_list[0]; ++i)
      to.numbers.push_back(number_of(from, from.constraint.word_list[i]));
  if (from.constraint_type == SANE_CONSTRAINT_STRING_LIST && from.constraint.string_list != nullptr)
    for (const SANE_String_Const* word = from.constraint.string_list; *word != nullptr; ++word)
      to.words.emplace_back(*word);
}

std::string value_of(SANE_Handle handle, SANE_Int number, const SANE_Option_Descriptor& option) {
  if (!SANE_OPTION_IS_ACTIVE(option.cap) || (option.cap & SANE_CAP_SOFT_DETECT) == 0) return "";
  const ScannerOption::Kind kind = kind_of(option);
  if (kind == ScannerOption::Kind::kOther) return "";
  std::vector<char> room(static_cast<std::size_t>(std::max(option.size, kWordSize)) + 1, '\0');
  if (sane_control_option(handle, number, SANE_ACTION_GET_VALUE, room.data(), nullptr) != SANE_STATUS_GOOD) return "";
  if (kind == ScannerOption::Kind::kText) return room.data();
  SANE_Word word = 0;
  std::memcpy(&word, room.data(), sizeof word);
  if (kind == ScannerOption::Kind::kYesNo) return word != SANE_FALSE ? "true" : "false";
  return in_digits(number_of(option, word));
}

Status set_option(SANE_Handle handle, const std::string& scanner, SANE_Int number, const SANE_Option_Descriptor& option,
                  const std::string& value) {
  // The device may write into it.
  std::vector<char> room(static_cast<std::size_t>(std::max(option.size, kWordSize)) + 1, '\0');
  const ScannerOption::Kind kind = kind_of(option);
  if (kind == ScannerOption::Kind::kText) {
    if (value.size() >= static_cast<std::size_t>(option.size))
      return Error{ErrorCode::kInvalidArgument,
                   fmt::format("the scanner {} takes at most {} characters for {}: write less", scanner,
                               option.size - 1, text_of(option.name))};
    std::ranges::copy(value, room.begin());
  } else {
    double figure = 0;
    std::from_chars(value.data(), value.data() + value.size(), figure);
    const SANE_Word word =
        kind == ScannerOption::Kind::kYesNo ? (value == "true" ? SANE_TRUE : SANE_FALSE) : word_of(option, figure);
    std::memcpy(room.data(), &word, sizeof word);
  }
  const std::string name = text_of(option.name);  // setting may make new descriptors
  const ScanStatus status = status_of(sane_control_option(handle, number, SANE_ACTION_SET_VALUE, room.data(), nullptr));
  if (status == ScanStatus::kGood) return Ok();
  return error_of(status, scanner, fmt::format("setting {} = {}", name, value));
}

}  // namespace

// Ending a scan makes some backends wait for a thread of theirs that never ends (SANE's own `test` now and then: it
// cancels one in the midst of malloc()). The picture, or the reason why there is none, is known by then and must not
// wait for them: such a backend is called no more.
class Ending {
 public:
  void call(const std::function<void()>& end) {
    if (!stuck_) stuck_ = !returns_within(std::chrono::seconds(5), end);
  }

 private:
  bool stuck_ = false;
};

OpenScanner::OpenScanner(void* handle, std::string name, std::shared_ptr<Ending> ending)
    : handle_(handle), name_(std::move(name)), ending_(std::move(ending)) {}

OpenScanner::~OpenScanner() {
  ending_->call([handle = handle_] { sane_close(handle); });
}

ScanStatus OpenScanner::start() { return status_of(sane_start(handle_)); }

void OpenScanner::cancel() {
  ending_->call([handle = handle_] { sane_cancel(handle); });
}

ScanStatus OpenScanner::parameters(FrameParameters& out) {
  SANE_Parameters p{};
  const ScanStatus status = status_of(sane_get_parameters(handle_, &p));
  using Kind = FrameParameters::Kind;
  switch (p.format) {
    case SANE_FRAME_GRAY:
      out.kind = Kind::kGrey;
      break;
    case SANE_FRAME_RGB:
      out.kind = Kind::kColour;
      break;
    case SANE_FRAME_RED:
      out.kind = Kind::kRed;
      break;
    case SANE_FRAME_GREEN:
      out.kind = Kind::kGreen;
      break;
    case SANE_FRAME_BLUE:
      out.kind = Kind::kBlue;
      break;
    default:
      out.kind = Kind::kOther;
  }
  out.last = p.last_frame != SANE_FALSE;
  out.bytes_per_line = p.bytes_per_line, out.pixels_per_line = p.pixels_per_line;
  out.lines = p.lines, out.depth = p.depth;
  return status;
}

ScanStatus OpenScanner::read(std::span<std::uint8_t> room, std::size_t& got) {
  SANE_Int length = 0;
  const ScanStatus status = status_of(sane_read(handle_, room.data(), static_cast<SANE_Int>(room.size()), &length));
  got = static_cast<std::size_t>(std::max(length, 0));
  return status;
}

std::vector<ScannerOption> OpenScanner::options() const {
  std::vector<ScannerOption> out;
  for (SANE_Int number = 1; const SANE_Option_Descriptor* option = sane_get_option_descriptor(handle_, number);
       ++number) {
    if (option->type == SANE_TYPE_GROUP || text_of(option->name).empty()) continue;
    ScannerOption& described = out.emplace_back();
    described.name = text_of(option->name);
    described.title = text_of(option->title);
    described.unit = unit_of(option->unit);
    described.kind = kind_of(*option);
    described.active = SANE_OPTION_IS_ACTIVE(option->cap);
    described.settable = SANE_OPTION_IS_SETTABLE(option->cap);
    describe_constraint(*option, described);
    described.value = value_of(handle_, number, *option);
  }
  return out;
}

Status OpenScanner::set(const ScannerOption& option, const std::string& value) {
  for (SANE_Int number = 1; const SANE_Option_Descriptor* described = sane_get_option_descriptor(handle_, number);
       ++number)
    if (described->type != SANE_TYPE_GROUP && text_of(described->name) == option.name)
      return set_option(handle_, name_, number, *described, value);
  return Error{ErrorCode::kNotFound,
               fmt::format("the scanner {} has no setting {}: see veneerctl scanner list", name_, option.name)};
}

SaneLibrary::SaneLibrary() : ending_(std::make_shared<Ending>()) {}

SaneLibrary::~SaneLibrary() {
  ending_->call([] { sane_exit(); });
}

Result<std::vector<FoundScanner>> SaneLibrary::find() {
  const SANE_Device** list = nullptr;
  const ScanStatus status = status_of(sane_get_devices(&list, SANE_FALSE));
  if (status != ScanStatus::kGood) return error_of(status, "that was looked for", "looking for scanners");
  std::vector<FoundScanner> out;
  for (; list != nullptr && *list != nullptr; ++list)
    out.push_back({text_of((*list)->name), text_of((*list)->vendor), text_of((*list)->model), text_of((*list)->type)});
  return out;
}

Result<std::unique_ptr<OpenScanner>> SaneLibrary::open_scanner(const std::string& name) {
  SANE_Handle handle = nullptr;
  const ScanStatus status = status_of(sane_open(name.c_str(), &handle));
  if (status != ScanStatus::kGood) return error_of(status, name, "opening it");
  return std::unique_ptr<OpenScanner>(new OpenScanner(handle, name, ending_));
}

Result<std::unique_ptr<SaneLibrary>> SaneLibrary::open(const std::filesystem::path& config) {
  // The only way to tell SANE. NOLINTNEXTLINE(concurrency-mt-unsafe): before it has a thread
  if (!config.empty() && ::setenv("SANE_CONFIG_DIR", config.c_str(), 1) != 0)
    return Error{ErrorCode::kUnavailable, "SANE cannot be told its configuration: free memory, then try again"};
  if (const ScanStatus status = status_of(sane_init(nullptr, nullptr)); status != ScanStatus::kGood)
    return error_of(status, "software SANE", "starting");
  return std::unique_ptr<SaneLibrary>(new SaneLibrary());
}

}  // namespace veneer::sane

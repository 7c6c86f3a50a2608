#include "exchange/text.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <ctime>

#include "refusal/message_text.h"

namespace sixpoint::exchange {
namespace {

using std::chrono::nanoseconds;
using std::chrono::system_clock;

constexpr int kMostDigits = 24, kMostDecimals = 22;
constexpr std::int64_t kNanosecondsInSecond = 1000000000;

std::tm CivilOf(system_clock::time_point time, std::int64_t* fraction_ns) {
  const std::int64_t ns = std::chrono::duration_cast<nanoseconds>(time.time_since_epoch()).count();
  std::time_t seconds = ns / kNanosecondsInSecond;
  *fraction_ns = ns % kNanosecondsInSecond;
  if (*fraction_ns < 0) {
    --seconds;
    *fraction_ns += kNanosecondsInSecond;
  }
  std::tm civil{};
  gmtime_r(&seconds, &civil);
  return civil;
}

// Takes so many digits off the front.
std::optional<int> Digits(std::string_view* text, std::size_t count) {
  if (text->size() < count) return std::nullopt;
  int number = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const char c = (*text)[i];
    if (c < '0' || c > '9') return std::nullopt;
    number = 10 * number + (c - '0');
  }
  text->remove_prefix(count);
  return number;
}

bool Take(std::string_view* text, char c) {
  if (text->empty() || text->front() != c) return false;
  text->remove_prefix(1);
  return true;
}

struct TimeFields {
  int year = 0, month = 0, day = 0, hour = 0, minute = 0, second = 0;
};

std::optional<system_clock::time_point> TimePoint(const TimeFields& f, std::int64_t offset_s,
                                                  std::int64_t fraction_ns) {
  if (f.year < 1970 || f.year > 2200 || f.hour > 23 || f.minute > 59 || f.second > 59) return std::nullopt;
  std::tm civil{};
  civil.tm_year = f.year - 1900;
  civil.tm_mon = f.month - 1;
  civil.tm_mday = f.day;
  civil.tm_hour = f.hour;
  civil.tm_min = f.minute;
  civil.tm_sec = f.second;
  const std::time_t seconds = timegm(&civil);
  // A day that the month does not have has become another.
  if (civil.tm_mday != f.day || civil.tm_mon != f.month - 1) return std::nullopt;
  return system_clock::time_point(std::chrono::duration_cast<system_clock::duration>(
      nanoseconds((seconds - offset_s) * kNanosecondsInSecond + fraction_ns)));
}

// ".5" as nanoseconds; what is finer is cut.
std::optional<std::int64_t> Fraction(std::string_view* text) {
  if (!Take(text, '.')) return 0;
  std::int64_t ns = 0, weight = kNanosecondsInSecond / 10;
  std::size_t count = 0;
  for (; count < text->size() && (*text)[count] >= '0' && (*text)[count] <= '9'; ++count, weight /= 10)
    ns += ((*text)[count] - '0') * weight;
  if (count == 0) return std::nullopt;
  text->remove_prefix(count);
  return ns;
}

// "Z", "+01:00" or nothing.
std::optional<std::int64_t> ZoneOffset(std::string_view text) {
  if (text.empty() || text == "Z" || text == "z") return 0;
  const bool west = text.front() == '-';
  if (!west && text.front() != '+') return std::nullopt;
  text.remove_prefix(1);
  const auto hours = Digits(&text, 2);
  if (!hours || !Take(&text, ':')) return std::nullopt;
  const auto minutes = Digits(&text, 2);
  if (!minutes || !text.empty() || *hours > 14 || *minutes > 59) return std::nullopt;
  return (west ? -1 : 1) * (*hours * 3600 + *minutes * 60);
}

}  // namespace

std::string DecimalText(double value) {
  char buffer[512];
  std::string text(buffer, std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::fixed).ptr);
  const auto digits = std::count_if(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
  if (digits <= kMostDigits) return text;
  text.assign(buffer,
              std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::fixed, kMostDecimals).ptr);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text;
}

std::optional<double> NumberOf(std::string_view text) {
  text = Trimmed(text);
  if (text.size() > 1 && text.front() == '+' && text[1] != '-') text.remove_prefix(1);
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(number)) return std::nullopt;
  return number;
}

std::optional<int> WholeNumberOf(std::string_view text) {
  text = Trimmed(text);
  int number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

std::string TimeText(system_clock::time_point time) {
  std::int64_t fraction_ns = 0;
  const std::tm t = CivilOf(time, &fraction_ns);
  char buffer[96];
  std::snprintf(buffer, sizeof buffer, "%04d-%02d-%02dT%02d:%02d:%02d", t.tm_year + 1900, t.tm_mon + 1, t.tm_mday,
                t.tm_hour, t.tm_min, t.tm_sec);
  std::string text = buffer;
  if (fraction_ns > 0) {
    std::snprintf(buffer, sizeof buffer, ".%09lld", static_cast<long long>(fraction_ns));
    text += buffer;
    text.erase(text.find_last_not_of('0') + 1);
  }
  return text + "Z";
}

std::optional<system_clock::time_point> TimeOf(std::string_view text) {
  text = Trimmed(text);
  TimeFields f;
  const struct {
    int* field;
    std::size_t digits;
    char before;
  } parts[] = {{&f.year, 4, 0},   {&f.month, 2, '-'},  {&f.day, 2, '-'},
               {&f.hour, 2, 'T'}, {&f.minute, 2, ':'}, {&f.second, 2, ':'}};
  for (const auto& part : parts) {
    if (part.before != 0 && !Take(&text, part.before)) return std::nullopt;
    const auto number = Digits(&text, part.digits);
    if (!number) return std::nullopt;
    *part.field = *number;
  }
  const auto fraction_ns = Fraction(&text);
  if (!fraction_ns) return std::nullopt;
  const auto offset_s = ZoneOffset(text);
  return offset_s ? TimePoint(f, *offset_s, *fraction_ns) : std::nullopt;
}

std::string DottedTimeText(system_clock::time_point time) {
  std::int64_t fraction_ns = 0;
  const std::tm t = CivilOf(time, &fraction_ns);
  char buffer[96];
  std::snprintf(buffer, sizeof buffer, "%02d.%02d.%04d/%02d:%02d:%02d", t.tm_mday, t.tm_mon + 1, t.tm_year + 1900,
                t.tm_hour, t.tm_min, t.tm_sec);
  return buffer;
}

std::optional<system_clock::time_point> DottedTimeOf(std::string_view text) {
  text = Trimmed(text);
  TimeFields f;
  const struct {
    int* field;
    std::size_t digits;
    char before;
    bool may_end;  // before it
  } parts[] = {{&f.day, 2, 0, false},   {&f.month, 2, '.', false},  {&f.year, 4, '.', false},
               {&f.hour, 2, '/', true}, {&f.minute, 2, ':', false}, {&f.second, 2, ':', true}};
  for (const auto& part : parts) {
    if (part.may_end && text.empty()) break;
    if (part.before != 0 && !Take(&text, part.before)) return std::nullopt;
    const auto number = Digits(&text, part.digits);
    if (!number) return std::nullopt;
    *part.field = *number;
  }
  return text.empty() ? TimePoint(f, 0, 0) : std::nullopt;
}

std::string_view Trimmed(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r\n";
  const std::size_t begin = text.find_first_not_of(kBlanks);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlanks) - begin + 1);
}

bool IsPlainText(std::string_view text) {
  if (std::all_of(text.begin(), text.end(), [](char c) { return c >= ' ' && c <= '~'; }))
    return true;  // nearly all are
  std::string shown(text);
  for (char& c : shown)
    if (c == '\t' || c == '\n' || c == '\r') c = ' ';
  // U+FFFE and U+FFFF are UTF-8, but no characters of XML.
  if (shown.find("\xef\xbf\xbe") != std::string::npos || shown.find("\xef\xbf\xbf") != std::string::npos) return false;
  return Tame(shown, shown.size() + 3) == shown;
}

std::optional<std::string> UuidOf(std::string_view resource_name) {
  constexpr std::size_t kLength = 36;
  if (resource_name.size() < kLength) return std::nullopt;
  const std::string_view uuid = resource_name.substr(resource_name.size() - kLength);
  if (resource_name.size() > kLength && resource_name[resource_name.size() - kLength - 1] != '/') return std::nullopt;
  for (std::size_t i = 0; i < kLength; ++i) {
    const bool dash = i == 8 || i == 13 || i == 18 || i == 23;
    const char c = uuid[i];
    const bool hex = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F');
    if (dash ? c != '-' : !hex) return std::nullopt;
  }
  return std::string(uuid);
}

}  // namespace sixpoint::exchange

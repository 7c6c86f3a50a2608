// Params and Rows: PostgreSQL's text forms, exact both ways.
#include <libpq-fe.h>

#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <limits>
#include <utility>

#include "refusal/message_text.h"
#include "storage/database.h"

namespace sixpoint::storage {
namespace {

constexpr std::size_t kLongestShown = 80;
constexpr char kNilUuid[] = "00000000-0000-0000-0000-000000000000";

std::string TextOfReal(double value) {
  if (std::isnan(value)) return "NaN";
  if (std::isinf(value)) return value > 0 ? "Infinity" : "-Infinity";
  char buffer[32];
  const auto written = std::to_chars(buffer, buffer + sizeof buffer, value);
  return std::string(buffer, written.ptr);
}

// The whole text as a number.
template <typename Number>
std::optional<Number> NumberOfText(std::string_view text) {
  Number value{};
  const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
  if (read.ec != std::errc() || read.ptr != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<double> RealOfText(std::string_view text) {
  if (text == "NaN") return std::numeric_limits<double>::quiet_NaN();
  if (text == "Infinity") return std::numeric_limits<double>::infinity();
  if (text == "-Infinity") return -std::numeric_limits<double>::infinity();
  return NumberOfText<double>(text);
}

std::optional<bool> BoolOfText(std::string_view text) {
  if (text != "t" && text != "f") return std::nullopt;
  return text == "t";
}

std::string TextOfTime(Instant value) {
  const auto microseconds = std::chrono::floor<std::chrono::microseconds>(value.time_since_epoch()).count();
  std::int64_t seconds = microseconds / 1'000'000;
  std::int64_t fraction = microseconds % 1'000'000;
  if (fraction < 0) {
    fraction += 1'000'000;
    --seconds;
  }
  const std::time_t whole = seconds;
  std::tm utc{};
  gmtime_r(&whole, &utc);
  char buffer[64];
  std::snprintf(buffer, sizeof buffer, "%04d-%02d-%02d %02d:%02d:%02d.%06d+00", utc.tm_year + 1900, utc.tm_mon + 1,
                utc.tm_mday, utc.tm_hour, utc.tm_min, utc.tm_sec, static_cast<int>(fraction));
  return buffer;
}

// "2026-11-21 03:27:26.5+00": the session speaks UTC and ISO.
std::optional<Instant> TimeOfText(const std::string& text) {
  std::tm utc{};
  int used = 0;
  if (std::sscanf(text.c_str(), "%d-%d-%d %d:%d:%d%n", &utc.tm_year, &utc.tm_mon, &utc.tm_mday, &utc.tm_hour,
                  &utc.tm_min, &utc.tm_sec, &used) != 6) {
    return std::nullopt;
  }
  utc.tm_year -= 1900;
  utc.tm_mon -= 1;
  std::int64_t microseconds = 0;
  size_t at = static_cast<size_t>(used);
  if (at < text.size() && text[at] == '.') {
    int digits = 0;
    for (++at; at < text.size() && text[at] >= '0' && text[at] <= '9'; ++at, ++digits) {
      microseconds = microseconds * 10 + (text[at] - '0');
    }
    for (; digits < 6; ++digits) microseconds *= 10;
  }
  if (text.compare(at, std::string::npos, "+00") != 0) return std::nullopt;
  return Instant(std::chrono::seconds(timegm(&utc)) + std::chrono::microseconds(microseconds));
}

std::string TextOfTexts(const std::vector<std::string>& values) {
  std::string text = "{";
  for (const std::string& value : values) {
    if (text.size() > 1) text += ',';
    text += '"';
    for (const char c : value) {
      if (c == '"' || c == '\\') text += '\\';
      text += c;
    }
    text += '"';
  }
  return text + "}";
}

// A one-dimensional array literal without NULLs.
std::optional<std::vector<std::string>> ElementsOfText(std::string_view text) {
  if (text.size() < 2 || text.front() != '{' || text.back() != '}') return std::nullopt;
  std::vector<std::string> elements;
  const std::string_view inside = text.substr(1, text.size() - 2);
  for (size_t at = 0; at < inside.size();) {
    std::string element;
    if (inside[at] == '"') {
      for (++at; at < inside.size() && inside[at] != '"'; ++at) {
        if (inside[at] == '\\') ++at;
        if (at >= inside.size()) return std::nullopt;
        element += inside[at];
      }
      ++at;
    } else {
      for (; at < inside.size() && inside[at] != ','; ++at) element += inside[at];
      if (element == "NULL") return std::nullopt;
    }
    elements.push_back(std::move(element));
    if (at < inside.size() && inside[at] != ',') return std::nullopt;
    ++at;
  }
  return elements;
}

std::optional<std::vector<double>> RealsOfText(std::string_view text) {
  const std::optional<std::vector<std::string>> elements = ElementsOfText(text);
  if (!elements) return std::nullopt;
  std::vector<double> values;
  for (const std::string& element : *elements) {
    const std::optional<double> value = RealOfText(element);
    if (!value) return std::nullopt;
    values.push_back(*value);
  }
  return values;
}

int NibbleOf(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return -1;
}

// "\\x" and two digits a byte.
std::optional<std::string> BytesOfText(std::string_view text) {
  if (text.size() < 2 || text.size() % 2 != 0 || text[0] != '\\' || text[1] != 'x') return std::nullopt;
  std::string bytes(text.size() / 2 - 1, '\0');
  for (size_t i = 0; i < bytes.size(); ++i) {
    const int high = NibbleOf(text[2 * i + 2]), low = NibbleOf(text[2 * i + 3]);
    if (high < 0 || low < 0) return std::nullopt;
    bytes[i] = static_cast<char>(high << 4 | low);
  }
  return bytes;
}

}  // namespace

Params& Params::Text(std::string_view value) {
  values_.push_back({std::string(value), false});
  return *this;
}
Params& Params::Int(std::int64_t value) { return Text(std::to_string(value)); }
Params& Params::Real(double value) { return Text(TextOfReal(value)); }
Params& Params::Bool(bool value) { return Text(value ? "t" : "f"); }
Params& Params::Time(Instant value) { return Text(TextOfTime(value)); }
Params& Params::Bytes(std::string_view value) {
  values_.push_back({std::string(value), true});
  return *this;
}
std::string ArrayText(const std::vector<double>& values) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "{" : ",") + TextOfReal(value);
  return text.empty() ? text : text + "}";
}
Params& Params::Reals(const std::vector<double>& values) { return Text(values.empty() ? "{}" : ArrayText(values)); }
Params& Params::OptionalInt(std::optional<std::int64_t> value) { return value ? Int(*value) : Null(); }
Params& Params::OptionalTime(std::optional<Instant> value) { return value ? Time(*value) : Null(); }
Params& Params::OptionalReal(std::optional<double> value) { return value ? Real(*value) : Null(); }

Params& Params::OptionalReals(const std::vector<std::optional<double>>& values) {
  std::string text = "{";
  for (const std::optional<double>& value : values) {
    if (text.size() > 1) text += ',';
    text += value ? TextOfReal(*value) : "NULL";
  }
  return Text(text + "}");
}
Params& Params::Texts(const std::vector<std::string>& values) { return Text(TextOfTexts(values)); }
Params& Params::Digest(std::string_view hex) { return Text("\\x" + std::string(hex)); }
Params& Params::Digests(const std::vector<std::string>& hex) {
  std::vector<std::string> texts;
  for (const std::string& digest : hex) texts.push_back("\\x" + digest);
  return Texts(texts);
}
Params& Params::Uuid(std::string_view id) { return Text(IsUuid(id) ? id : kNilUuid); }
Params& Params::OptionalUuid(std::string_view id) { return id.empty() ? Null() : Uuid(id); }
Params& Params::TextOrNull(const std::optional<std::string>& text) { return text ? Text(*text) : Null(); }
Params& Params::OptionalText(std::string_view text) { return text.empty() ? Null() : Text(text); }
Params& Params::Uuids(const std::vector<std::string>& ids) {
  std::vector<std::string> known;
  for (const std::string& id : ids) known.emplace_back(IsUuid(id) ? id : kNilUuid);
  return Texts(known);
}
Params& Params::Null() {
  values_.push_back({std::nullopt, false});
  return *this;
}

struct Rows::State {
  explicit State(pg_result* of) : result(of) {}
  ~State() { PQclear(result); }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  pg_result* const result;
  absl::Status status;
};

Rows::Rows(pg_result* result) : state_(std::make_shared<State>(result)) {}

int Rows::count() const { return state_ == nullptr ? 0 : PQntuples(state_->result); }

int Rows::affected() const {
  const char* count = state_ == nullptr ? "" : PQcmdTuples(state_->result);
  return *count == '\0' ? 0 : std::atoi(count);
}

absl::Status Rows::status() const { return state_ == nullptr ? absl::OkStatus() : state_->status; }

bool Rows::Has(int row, int column) const {
  return row >= 0 && row < count() && column >= 0 && column < PQnfields(state_->result);
}

bool Rows::IsNull(int row, int column) const {
  return !Has(row, column) || PQgetisnull(state_->result, row, column) != 0;
}

std::optional<std::string_view> Rows::Value(int row, int column, const char* wanted) const {
  if (!IsNull(row, column))
    return std::string_view(PQgetvalue(state_->result, row, column),
                            static_cast<size_t>(PQgetlength(state_->result, row, column)));
  Unreadable(row, column, Has(row, column) ? "NULL" : "nothing", wanted);
  return std::nullopt;
}

void Rows::Unreadable(int row, int column, std::string_view found, const char* wanted) const {
  if (state_ == nullptr || !state_->status.ok()) return;
  const char* name = PQfname(state_->result, column);
  state_->status = absl::InternalError(
      "database: column " + std::to_string(column) + (name == nullptr ? "" : " (" + std::string(name) + ")") +
      " of row " + std::to_string(row) + " holds " + Tame(std::string(found), kLongestShown) + ", want " + wanted);
}

template <typename T, typename Parse>
T Rows::Parsed(int row, int column, const char* wanted, Parse parse, T otherwise) const {
  const std::optional<std::string_view> text = Value(row, column, wanted);
  if (!text) return otherwise;
  std::optional<T> value = parse(std::string(*text));
  if (value) return *std::move(value);
  Unreadable(row, column, *text, wanted);
  return otherwise;
}

std::string Rows::Text(int row, int column) const { return std::string(Value(row, column, "a text").value_or("")); }
std::int64_t Rows::Int(int row, int column) const {
  return Parsed<std::int64_t>(row, column, "an integer", NumberOfText<std::int64_t>, 0);
}
double Rows::Real(int row, int column) const {
  return Parsed<double>(row, column, "a number", RealOfText, std::numeric_limits<double>::quiet_NaN());
}
std::optional<double> Rows::OptionalReal(int row, int column) const {
  if (IsNull(row, column)) return std::nullopt;
  return Real(row, column);
}
std::string Rows::OptionalText(int row, int column) const { return IsNull(row, column) ? "" : Text(row, column); }
bool Rows::Bool(int row, int column) const { return Parsed<bool>(row, column, "a boolean", BoolOfText, false); }
Instant Rows::Time(int row, int column) const {
  return Parsed<Instant>(row, column, "a time in UTC", TimeOfText, Instant());
}
std::string Rows::Bytes(int row, int column) const {
  if (!IsNull(row, column) && PQfformat(state_->result, column) == 1) return std::string(*Value(row, column, "bytes"));
  return Parsed<std::string>(row, column, "bytes", BytesOfText, "");
}
std::string Rows::Digest(int row, int column) const {
  const std::optional<std::string_view> text = Value(row, column, "bytes");
  if (!text) return "";
  if (BytesOfText(*text)) return std::string(text->substr(2));
  Unreadable(row, column, *text, "bytes");
  return "";
}
std::vector<double> Rows::Reals(int row, int column) const {
  return Parsed<std::vector<double>>(row, column, "an array of numbers", RealsOfText, {});
}
std::vector<std::string> Rows::Texts(int row, int column) const {
  return Parsed<std::vector<std::string>>(row, column, "an array of texts", ElementsOfText, {});
}

}  // namespace sixpoint::storage

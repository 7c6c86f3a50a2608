// Params and Rows: PostgreSQL's text forms, exact both ways.
#include <libpq-fe.h>

#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <limits>

#include "storage/database.h"

namespace sixpoint::storage {
namespace {

[[noreturn]] void WrongType(const char* wanted, std::string_view text) {
  std::fprintf(stderr, "storage: a column holds '%.*s', want %s\n", static_cast<int>(std::min<size_t>(text.size(), 80)),
               text.data(), wanted);
  std::abort();
}

std::string TextOfReal(double value) {
  if (std::isnan(value)) return "NaN";
  if (std::isinf(value)) return value > 0 ? "Infinity" : "-Infinity";
  char buffer[32];
  const auto written = std::to_chars(buffer, buffer + sizeof buffer, value);
  return std::string(buffer, written.ptr);
}

double RealOfText(std::string_view text) {
  if (text == "NaN") return std::numeric_limits<double>::quiet_NaN();
  if (text == "Infinity") return std::numeric_limits<double>::infinity();
  if (text == "-Infinity") return -std::numeric_limits<double>::infinity();
  double value = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
  if (read.ec != std::errc() || read.ptr != text.data() + text.size()) WrongType("a double", text);
  return value;
}

std::int64_t IntOfText(std::string_view text) {
  std::int64_t value = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
  if (read.ec != std::errc() || read.ptr != text.data() + text.size()) WrongType("an integer", text);
  return value;
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
Instant TimeOfText(const std::string& text) {
  std::tm utc{};
  int used = 0;
  if (std::sscanf(text.c_str(), "%d-%d-%d %d:%d:%d%n", &utc.tm_year, &utc.tm_mon, &utc.tm_mday, &utc.tm_hour,
                  &utc.tm_min, &utc.tm_sec, &used) != 6) {
    WrongType("a time", text);
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
  if (text.compare(at, std::string::npos, "+00") != 0) WrongType("a time in UTC", text);
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
std::vector<std::string> ElementsOfText(std::string_view text) {
  if (text.size() < 2 || text.front() != '{' || text.back() != '}') WrongType("an array", text);
  std::vector<std::string> elements;
  const std::string_view inside = text.substr(1, text.size() - 2);
  for (size_t at = 0; at < inside.size();) {
    std::string element;
    if (inside[at] == '"') {
      for (++at; at < inside.size() && inside[at] != '"'; ++at) {
        if (inside[at] == '\\') ++at;
        if (at >= inside.size()) WrongType("an array", text);
        element += inside[at];
      }
      ++at;
    } else {
      for (; at < inside.size() && inside[at] != ','; ++at) element += inside[at];
      if (element == "NULL") WrongType("an array without NULL", text);
    }
    elements.push_back(std::move(element));
    if (at < inside.size() && inside[at] != ',') WrongType("an array of one dimension", text);
    ++at;
  }
  return elements;
}

int NibbleOf(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return -1;
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
Params& Params::Reals(const std::vector<double>& values) {
  std::string text = "{";
  for (const double value : values) {
    if (text.size() > 1) text += ',';
    text += TextOfReal(value);
  }
  return Text(text + "}");
}
Params& Params::OptionalReals(const std::vector<std::optional<double>>& values) {
  std::string text = "{";
  for (const std::optional<double>& value : values) {
    if (text.size() > 1) text += ',';
    text += value ? TextOfReal(*value) : "NULL";
  }
  return Text(text + "}");
}
Params& Params::Texts(const std::vector<std::string>& values) { return Text(TextOfTexts(values)); }
Params& Params::Null() {
  values_.push_back({std::nullopt, false});
  return *this;
}

Rows::Rows(pg_result* result) : result_(result, [](pg_result* owned) { PQclear(owned); }) {}

int Rows::count() const { return result_ == nullptr ? 0 : PQntuples(result_.get()); }

int Rows::affected() const {
  const char* count = result_ == nullptr ? "" : PQcmdTuples(result_.get());
  return *count == '\0' ? 0 : std::atoi(count);
}

bool Rows::IsNull(int row, int column) const { return PQgetisnull(result_.get(), row, column) != 0; }

std::string Rows::Text(int row, int column) const {
  if (row < 0 || row >= count() || column < 0 || column >= PQnfields(result_.get())) {
    WrongType("a row and column of the result", std::to_string(row) + ", " + std::to_string(column));
  }
  if (IsNull(row, column)) WrongType("a value", "NULL");
  return std::string(PQgetvalue(result_.get(), row, column),
                     static_cast<size_t>(PQgetlength(result_.get(), row, column)));
}

std::int64_t Rows::Int(int row, int column) const { return IntOfText(Text(row, column)); }
double Rows::Real(int row, int column) const { return RealOfText(Text(row, column)); }
bool Rows::Bool(int row, int column) const {
  const std::string text = Text(row, column);
  if (text != "t" && text != "f") WrongType("a boolean", text);
  return text == "t";
}
Instant Rows::Time(int row, int column) const { return TimeOfText(Text(row, column)); }

std::string Rows::Bytes(int row, int column) const {
  if (IsNull(row, column)) WrongType("bytes", "NULL");
  const char* text = PQgetvalue(result_.get(), row, column);
  const size_t length = static_cast<size_t>(PQgetlength(result_.get(), row, column));
  if (PQfformat(result_.get(), column) == 1) return std::string(text, length);
  if (length < 2 || length % 2 != 0 || text[0] != '\\' || text[1] != 'x') WrongType("bytes", text);
  std::string bytes(length / 2 - 1, '\0');
  for (size_t i = 0; i < bytes.size(); ++i) {
    const int high = NibbleOf(text[2 * i + 2]), low = NibbleOf(text[2 * i + 3]);
    if (high < 0 || low < 0) WrongType("bytes", text);
    bytes[i] = static_cast<char>(high << 4 | low);
  }
  return bytes;
}

std::vector<double> Rows::Reals(int row, int column) const {
  std::vector<double> values;
  for (const std::string& element : ElementsOfText(Text(row, column))) values.push_back(RealOfText(element));
  return values;
}

std::vector<std::string> Rows::Texts(int row, int column) const { return ElementsOfText(Text(row, column)); }

}  // namespace sixpoint::storage

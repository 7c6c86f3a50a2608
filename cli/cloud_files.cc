#include "cli/cloud_files.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <vector>

#include "cli/document.h"
#include "metrology/cloud/draco_codec.h"
#include "refusal/refusal.h"

namespace sixpoint::cli {
namespace {

std::string Quoted(std::string_view text) {
  std::string shown = "'";
  for (const char c : text.substr(0, 40)) shown += c >= 0x20 && c < 0x7f ? c : '?';
  return shown + (text.size() > 40 ? "...'" : "'");
}

// Takes lines off the front of the text.
class Lines {
 public:
  explicit Lines(std::string_view text) : text_(text) {}
  bool Next(std::string_view* line) {
    if (text_.empty()) return false;
    ++number_;
    const std::size_t end = text_.find('\n');
    *line = text_.substr(0, end);
    text_ = end == std::string_view::npos ? std::string_view() : text_.substr(end + 1);
    if (!line->empty() && line->back() == '\r') line->remove_suffix(1);
    return true;
  }
  std::string_view rest() const { return text_; }
  std::int64_t number() const { return number_; }

 private:
  std::string_view text_;
  std::int64_t number_ = 0;
};

bool IsSeparator(char c) { return c == ' ' || c == '\t' || c == ',' || c == ';'; }

// At most `limit` words.
std::vector<std::string_view> Words(std::string_view line, std::size_t limit) {
  std::vector<std::string_view> words;
  std::size_t i = 0;
  while (words.size() < limit) {
    while (i < line.size() && IsSeparator(line[i])) ++i;
    if (i == line.size()) break;
    const std::size_t start = i;
    while (i < line.size() && !IsSeparator(line[i])) ++i;
    words.push_back(line.substr(start, i - start));
  }
  return words;
}

template <typename T>
bool ParseNumber(std::string_view word, T* value) {
  if (!word.empty() && word.front() == '+') word.remove_prefix(1);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), *value);
  return error == std::errc() && end == word.data() + word.size();
}

// One point a line, x, y, z in the columns given; exactly `count` lines, or as many as there are for count < 0.
absl::StatusOr<metrology::Points> ParseRows(const std::string& name, Lines lines,
                                            const std::array<std::size_t, 3>& columns, std::int64_t count) {
  metrology::Points points;
  // Six bytes hold the shortest line, so a header cannot make us reserve more than the file is long.
  points.reserve(
      std::min<std::size_t>(lines.rest().size() / 6 + 1, count < 0 ? 1024 : static_cast<std::size_t>(count)));
  const std::size_t word_count = *std::max_element(columns.begin(), columns.end()) + 1;
  std::string_view line;
  while ((count < 0 || static_cast<std::int64_t>(points.size()) < count) && lines.Next(&line)) {
    const std::vector<std::string_view> words = Words(line, word_count);
    if (words.empty() || words[0][0] == '#' || words[0].substr(0, 2) == "//") continue;
    const std::string where = name + ": line " + std::to_string(lines.number());
    if (words.size() < word_count) return Refuse(where, Quoted(line), std::to_string(word_count) + " numbers");
    Eigen::Vector3d point;
    for (int k = 0; k < 3; ++k) {
      if (!ParseNumber(words[columns[k]], &point[k]) || !std::isfinite(point[k])) {
        return Refuse(where, Quoted(words[columns[k]]), "a finite number");
      }
    }
    if (static_cast<std::int64_t>(points.size()) >= kGreatestCloudPointCount) {
      return Refuse(name, "more points", "at most " + std::to_string(kGreatestCloudPointCount));
    }
    points.push_back(point);
  }
  if (count >= 0 && static_cast<std::int64_t>(points.size()) != count) {
    return Refuse(name, std::to_string(points.size()) + " points", std::to_string(count) + ", as its header says");
  }
  if (points.empty()) return Refuse(name, "0 points", "at least 1");
  return points;
}

absl::StatusOr<std::int64_t> ParseCount(const std::string& where, std::string_view word) {
  std::int64_t count = 0;
  if (!ParseNumber(word, &count) || count < 1 || count > kGreatestCloudPointCount) {
    return Refuse(where, Quoted(word), "1 to " + std::to_string(kGreatestCloudPointCount) + " points");
  }
  return count;
}

// Where x, y and z stand in each point of a binary file.
struct Record {
  std::size_t stride_bytes = 0;
  std::array<std::size_t, 3> offset_bytes = {0, 0, 0};
  std::array<std::size_t, 3> size_bytes = {0, 0, 0};  // 4: a float, 8: a double
};

absl::StatusOr<metrology::Points> ReadRecords(const std::string& name, std::string_view body, const Record& record,
                                              std::int64_t point_count) {
  const auto count = static_cast<std::size_t>(point_count);
  if (body.size() / record.stride_bytes < count) {
    return Refuse(name, std::to_string(body.size() / record.stride_bytes) + " points",
                  std::to_string(count) + ", as its header says");
  }
  metrology::Points points(count);
  for (std::size_t i = 0; i < count; ++i) {
    for (int k = 0; k < 3; ++k) {
      const char* at = body.data() + i * record.stride_bytes + record.offset_bytes[k];
      if (record.size_bytes[k] == 8) {
        std::memcpy(&points[i][k], at, 8);
      } else {
        float value = 0;
        std::memcpy(&value, at, 4);
        points[i][k] = value;
      }
      if (!std::isfinite(points[i][k])) {
        return Refuse(name + ": point " + std::to_string(i), points[i][k], "finite coordinates");
      }
    }
  }
  return points;
}

// Bytes of a scalar PLY type; 0 for others.
std::size_t PlyTypeSize(std::string_view type) {
  if (type == "char" || type == "uchar" || type == "int8" || type == "uint8") return 1;
  if (type == "short" || type == "ushort" || type == "int16" || type == "uint16") return 2;
  if (type == "int" || type == "uint" || type == "int32" || type == "uint32" || type == "float" || type == "float32") {
    return 4;
  }
  return type == "double" || type == "float64" ? 8 : 0;
}

struct PlyHeader {
  bool binary = false;
  std::int64_t vertex_count = -1;
  Record record;
  std::array<std::size_t, 3> column = {SIZE_MAX, SIZE_MAX, SIZE_MAX};
};

absl::StatusOr<PlyHeader> ParsePlyHeader(const std::string& name, Lines* lines) {
  constexpr int kGreatestHeaderLineCount = 1000;
  PlyHeader header;
  bool in_vertex = false, format_seen = false, other_seen = false;
  std::size_t property_count = 0;
  std::string_view line;
  if (!lines->Next(&line) || line != "ply") return Refuse(name + ": line 1", Quoted(line), "'ply'");
  while (lines->number() < kGreatestHeaderLineCount && lines->Next(&line)) {
    const std::string where = name + ": line " + std::to_string(lines->number());
    const std::vector<std::string_view> words = Words(line, 8);
    if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
    if (words[0] == "end_header") {
      if (!format_seen || header.vertex_count < 0) return Refuse(where, "no format or vertex element", "both");
      for (int k = 0; k < 3; ++k) {
        if (header.column[k] == SIZE_MAX) return Refuse(where, std::string("no property ") + "xyz"[k], "x, y and z");
      }
      return header;
    }
    if (words[0] == "format") {
      if (words.size() < 2 || (words[1] != "ascii" && words[1] != "binary_little_endian")) {
        return Refuse(where, Quoted(line), "format ascii or binary_little_endian");
      }
      header.binary = words[1] != "ascii";
      format_seen = true;
    } else if (words[0] == "element") {
      if (words.size() != 3) return Refuse(where, Quoted(line), "element NAME COUNT");
      in_vertex = words[1] == "vertex";
      if (in_vertex) {
        if (other_seen || header.vertex_count >= 0)
          return Refuse(where, Quoted(line), "vertex once and before other elements");
        absl::StatusOr<std::int64_t> count = ParseCount(where, words[2]);
        if (!count.ok()) return count.status();
        header.vertex_count = *count;
      } else {
        other_seen = true;
      }
    } else if (words[0] == "property" && in_vertex) {
      const std::size_t size = words.size() == 3 ? PlyTypeSize(words[1]) : 0;
      if (size == 0) return Refuse(where, Quoted(line), "property TYPE NAME, no lists in a vertex");
      for (std::size_t k = 0; k < 3; ++k) {
        if (words[2] != std::string_view("xyz").substr(k, 1)) continue;
        if (words[1] != "float" && words[1] != "float32" && size != 8)
          return Refuse(where, Quoted(line), "float or double");
        header.column[k] = property_count;
        header.record.offset_bytes[k] = header.record.stride_bytes;
        header.record.size_bytes[k] = size;
      }
      ++property_count;
      header.record.stride_bytes += size;
    } else if (words[0] != "property") {
      return Refuse(where, Quoted(line), "a line of a PLY header");
    }
  }
  return Refuse(name, "no end_header", "one within " + std::to_string(kGreatestHeaderLineCount) + " lines");
}

struct PcdHeader {
  bool binary = false;
  std::int64_t point_count = -1;
  Record record;
  std::array<std::size_t, 3> column = {SIZE_MAX, SIZE_MAX, SIZE_MAX};
};

// FIELDS with their SIZE and TYPE, one value each.
struct PcdFields {
  std::vector<std::string_view> names, sizes, types;
};

absl::Status ReadFields(const std::string& where, const PcdFields& fields, PcdHeader* header) {
  for (std::size_t i = 0; i < fields.names.size(); ++i) {
    std::size_t size = 0;
    if (header->binary && (fields.sizes.size() != fields.names.size() || fields.types.size() != fields.names.size() ||
                           !ParseNumber(fields.sizes[i], &size) || size < 1 || size > 8))
      return Refuse(where, "SIZE or TYPE of other fields than FIELDS", "1 to 8 bytes and a type of each");
    for (std::size_t k = 0; k < 3; ++k) {
      if (fields.names[i] != std::string_view("xyz").substr(k, 1)) continue;
      if (header->binary && (fields.types[i] != "F" || (size != 4 && size != 8)))
        return Refuse(where, Quoted(fields.names[i]) + " of TYPE " + Quoted(fields.types[i]), "F of 4 or 8 bytes");
      header->column[k] = i;
      header->record.offset_bytes[k] = header->record.stride_bytes;
      header->record.size_bytes[k] = size;
    }
    header->record.stride_bytes += size;
  }
  for (const std::size_t column : header->column)
    if (column == SIZE_MAX) return Refuse(where, "FIELDS without x, y or z", "all three");
  return absl::OkStatus();
}

absl::StatusOr<PcdHeader> ParsePcdHeader(const std::string& name, Lines* lines) {
  PcdHeader header;
  PcdFields fields;
  std::string_view line;
  while (lines->number() < 100 && lines->Next(&line)) {
    const std::string where = name + ": line " + std::to_string(lines->number());
    const std::vector<std::string_view> words = Words(line, 64);
    if (words.empty() || words[0][0] == '#') continue;
    const std::vector<std::string_view> values(words.begin() + 1, words.end());
    if (words[0] == "FIELDS") {
      fields.names = values;
    } else if (words[0] == "SIZE") {
      fields.sizes = values;
    } else if (words[0] == "TYPE") {
      fields.types = values;
    } else if (words[0] == "COUNT") {
      // Several values in one field would shift the columns after it.
      for (const std::string_view value : values)
        if (value != "1") return Refuse(where, Quoted(line), "COUNT 1 for every field");
    } else if (words[0] == "POINTS") {
      absl::StatusOr<std::int64_t> parsed = ParseCount(where, values.size() == 1 ? values[0] : "");
      if (!parsed.ok()) return parsed.status();
      header.point_count = *parsed;
    } else if (words[0] == "DATA") {
      if (values.size() != 1 || (values[0] != "ascii" && values[0] != "binary"))
        return Refuse(where, Quoted(line), "DATA ascii or DATA binary");
      if (header.point_count < 0) return Refuse(where, "no POINTS", "POINTS before DATA");
      header.binary = values[0] == "binary";
      if (absl::Status read = ReadFields(where, fields, &header); !read.ok()) return read;
      return header;
    }
  }
  return Refuse(name, "no DATA line", "one within 100 lines");
}

}  // namespace

absl::StatusOr<metrology::Points> ParsePly(const std::string& name, std::string_view bytes) {
  Lines lines(bytes);
  absl::StatusOr<PlyHeader> header = ParsePlyHeader(name, &lines);
  if (!header.ok()) return header.status();
  if (!header->binary) return ParseRows(name, lines, header->column, header->vertex_count);
  return ReadRecords(name, lines.rest(), header->record, header->vertex_count);
}

absl::StatusOr<metrology::Points> ParsePcd(const std::string& name, std::string_view bytes) {
  Lines lines(bytes);
  absl::StatusOr<PcdHeader> header = ParsePcdHeader(name, &lines);
  if (!header.ok()) return header.status();
  if (!header->binary) return ParseRows(name, lines, header->column, header->point_count);
  return ReadRecords(name, lines.rest(), header->record, header->point_count);
}

absl::StatusOr<metrology::Points> ParseXyz(const std::string& name, std::string_view bytes) {
  return ParseRows(name, Lines(bytes), {0, 1, 2}, -1);
}

absl::StatusOr<metrology::Points> ReadCloud(const std::string& path) {
  const std::string ending = std::filesystem::path(path).extension().string();
  const bool text = ending == ".xyz" || ending == ".txt" || ending == ".csv";
  if (!text && ending != ".ply" && ending != ".pcd" && ending != ".drc") {
    return Refuse(path, "file name ends in '" + ending + "'", ".drc, .ply, .pcd, .xyz, .txt or .csv");
  }
  absl::StatusOr<std::string> bytes = ReadFile(path, kGreatestCloudBytes);
  if (!bytes.ok()) return bytes.status();
  if (text) return ParseXyz(path, *bytes);
  if (ending == ".ply") return ParsePly(path, *bytes);
  if (ending == ".pcd") return ParsePcd(path, *bytes);
  absl::StatusOr<metrology::DracoHeader> header = metrology::InspectHeader(*bytes, kGreatestCloudPointCount);
  if (!header.ok()) return absl::Status(header.status().code(), path + ": " + std::string(header.status().message()));
  absl::StatusOr<metrology::Points> points = metrology::DecodeBlock(*bytes, header->point_count);
  if (!points.ok()) return absl::Status(points.status().code(), path + ": " + std::string(points.status().message()));
  return points;
}

std::string ToPly(const metrology::Points& points) {
  std::string text = "ply\nformat binary_little_endian 1.0\ncomment millimetres\nelement vertex " +
                     std::to_string(points.size()) +
                     "\nproperty double x\nproperty double y\nproperty double z\nend_header\n";
  const std::size_t start = text.size();
  text.resize(start + points.size() * 24);
  for (std::size_t i = 0; i < points.size(); ++i) std::memcpy(&text[start + 24 * i], points[i].data(), 24);
  return text;
}

std::string ToXyz(const metrology::Points& points) {
  std::string text;
  text.reserve(points.size() * 40);
  char number[32];
  for (const Eigen::Vector3d& point : points) {
    for (int k = 0; k < 3; ++k) {
      const auto written = std::to_chars(number, number + sizeof number, point[k]);
      text.append(number, written.ptr);
      text += k < 2 ? ' ' : '\n';
    }
  }
  return text;
}

absl::StatusOr<CloudWriter> CloudWriterFor(const std::string& path) {
  const std::string ending = std::filesystem::path(path).extension().string();
  if (ending == ".ply") return ToPly;
  if (ending == ".xyz" || path == "-") return ToXyz;
  return Refuse(path, "file name ends in '" + ending + "'", ".ply or .xyz");
}

}  // namespace sixpoint::cli

#include "report/font_file.h"

#include <cstdint>
#include <fstream>
#include <iterator>

namespace sixpoint::report {
namespace {

constexpr std::size_t kMostBytes = 16 << 20;

// Big-endian numbers of a file; 0 beyond its end.
struct Bytes {
  std::string text;
  std::uint32_t At(std::size_t i) const { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0; }
  std::uint32_t Short(std::size_t i) const { return At(i) << 8 | At(i + 1); }
  std::uint32_t Long(std::size_t i) const { return Short(i) << 16 | Short(i + 2); }
};

// Where the table of segments begins; 0: there is none.
std::size_t SegmentsOf(const Bytes& font) {
  const std::size_t tables = font.Short(4);
  for (std::size_t t = 0; t < tables; ++t) {
    const std::size_t entry = 12 + 16 * t;
    if (font.Long(entry) != 0x636d6170) continue;  // "cmap"
    const std::size_t cmap = font.Long(entry + 8), count = font.Short(cmap + 2);
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t encoding = cmap + 4 + 8 * i, begin = cmap + font.Long(encoding + 4);
      if (font.Short(encoding) == 3 && font.Short(encoding + 2) == 1 && font.Short(begin) == 4) return begin;
    }
  }
  return 0;
}

}  // namespace

absl::StatusOr<std::vector<bool>> CharactersOf(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  Bytes font;
  if (file) font.text.assign(std::istreambuf_iterator<char>(file), {});
  if (font.text.size() < 12 || font.text.size() > kMostBytes)
    return absl::FailedPreconditionError("no font at " + path + ": install fonts-dejavu-core");
  const std::size_t begin = SegmentsOf(font);
  if (begin == 0) return absl::FailedPreconditionError(path + " is a font without a table of Unicode characters");
  const std::size_t twice = font.Short(begin + 6), ends = begin + 14, starts = ends + twice + 2;
  std::vector<bool> has(65536, false);
  for (std::size_t s = 0; s + 1 < twice; s += 2) {
    const std::uint32_t first = font.Short(starts + s), last = font.Short(ends + s);
    const std::uint32_t delta = font.Short(starts + twice + s);
    const std::size_t range = starts + 2 * twice + s, offset = font.Short(range);
    for (std::uint32_t c = first; c <= last && c < 0xffff; ++c) {
      std::uint32_t glyph = offset == 0 ? c + delta : font.Short(range + offset + 2 * (c - first));
      if (offset != 0 && glyph != 0) glyph += delta;
      has[c] = (glyph & 0xffff) != 0;
    }
  }
  return has;
}

}  // namespace sixpoint::report

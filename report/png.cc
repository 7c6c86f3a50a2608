#include <png.h>

#include <csetjmp>
#include <memory>

#include "refusal/refusal.h"
#include "report/picture.h"

namespace sixpoint::report {
namespace {

void Append(png_structp png, png_bytep bytes, png_size_t count) {
  static_cast<std::string*>(png_get_io_ptr(png))->append(reinterpret_cast<const char*>(bytes), count);
}

// libpng leaves by longjmp: nothing with a destructor may live in here.
bool WriteRows(png_structp png, png_infop info, const Picture& picture, std::string* bytes) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_set_write_fn(png, bytes, Append, nullptr);
  png_set_IHDR(png, info, static_cast<png_uint_32>(picture.width_px), static_cast<png_uint_32>(picture.height_px), 8,
               PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_compression_level(png, 6);
  png_write_info(png, info);
  const std::size_t row_bytes = 3 * static_cast<std::size_t>(picture.width_px);
  for (int y = 0; y < picture.height_px; ++y)
    png_write_row(png, picture.rgb.data() + row_bytes * static_cast<std::size_t>(y));
  png_write_end(png, info);
  return true;
}

}  // namespace

absl::Status Check(const Picture& picture) {
  const auto fits = [](int side) { return side > 0 && side <= kMostPixels; };
  const std::string wanted = "1 to " + std::to_string(kMostPixels);
  if (!fits(picture.width_px)) return Refuse("width_px", picture.width_px, wanted);
  if (!fits(picture.height_px)) return Refuse("height_px", picture.height_px, wanted);
  const std::size_t bytes =
      3 * static_cast<std::size_t>(picture.width_px) * static_cast<std::size_t>(picture.height_px);
  if (picture.rgb.size() != bytes)
    return Refuse("rgb", std::to_string(picture.rgb.size()) + " bytes", std::to_string(bytes));
  return absl::OkStatus();
}

absl::StatusOr<std::string> ToPng(const Picture& picture) {
  if (absl::Status status = Check(picture); !status.ok()) return status;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png ? png_create_info_struct(png) : nullptr;
  std::string bytes;
  const bool written = info && WriteRows(png, info, picture, &bytes);
  png_destroy_write_struct(&png, info ? &info : nullptr);
  if (!written) return absl::ResourceExhaustedError("libpng did not write a picture");
  return bytes;
}

}  // namespace sixpoint::report

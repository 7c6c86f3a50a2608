#include "report/svg.h"

#include <absl/strings/escaping.h>

#include <charconv>

namespace sixpoint::report {
namespace {

// To a hundredth of a mm, by a dot whatever the locale.
std::string Millimetres(double mm) {
  char buffer[64];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, mm, std::chars_format::fixed, 3);
  std::string text(buffer, end.ptr);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text == "-0" ? "0" : text;
}

std::string Hex(Colour c) {
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string text = "#";
  for (const std::uint8_t x : {c.r, c.g, c.b}) text += {kDigits[x >> 4], kDigits[x & 15]};
  return text;
}

std::string Paint(const std::optional<Pen>& pen, const std::optional<Colour>& fill) {
  std::string text = " fill=\"" + (fill ? Hex(*fill) : "none") + "\"";
  if (!pen) return text;
  text += " stroke=\"" + Hex(pen->colour) + "\" stroke-width=\"" + Millimetres(pen->width_mm) + "\"";
  if (pen->dash_mm > 0) text += " stroke-dasharray=\"" + Millimetres(pen->dash_mm) + "\"";
  return text;
}

class SvgWriter {
 public:
  explicit SvgWriter(std::string* html) : html_(*html) {}

  absl::Status operator()(const Path& path) {
    html_ += "<path d=\"";
    char step = 'M';
    for (const Place& place : path.places) {
      html_ += step;
      html_ += Millimetres(place.x_mm) + " " + Millimetres(place.y_mm);
      step = 'L';
    }
    html_ += std::string(path.closed ? "Z" : "") + "\"" + Paint(path.pen, path.fill) + "/>";
    return absl::OkStatus();
  }

  absl::Status operator()(const Disc& disc) {
    html_ += "<circle cx=\"" + Millimetres(disc.centre.x_mm) + "\" cy=\"" + Millimetres(disc.centre.y_mm) + "\" r=\"" +
             Millimetres(disc.radius_mm) + "\"" + Paint(disc.pen, disc.fill) + "/>";
    return absl::OkStatus();
  }

  absl::Status operator()(const Label& label) {
    const char* anchor = label.anchor == Anchor::kStart ? ""
                         : label.anchor == Anchor::kEnd ? " text-anchor=\"end\""
                                                        : " text-anchor=\"middle\"";
    html_ += "<text x=\"" + Millimetres(label.at.x_mm) + "\" y=\"" + Millimetres(label.at.y_mm) + "\" font-size=\"" +
             Millimetres(label.size_mm) + "\"" + anchor + (label.bold ? " font-weight=\"700\"" : "") + " fill=\"" +
             Hex(label.colour) + "\">" + Escaped(label.text) + "</text>";
    return absl::OkStatus();
  }

  absl::Status operator()(const Raster& raster) {
    const absl::StatusOr<std::string> png = ToPng(*raster.picture);
    if (!png.ok()) return png.status();
    html_ += "<image x=\"" + Millimetres(raster.corner.x_mm) + "\" y=\"" + Millimetres(raster.corner.y_mm) +
             "\" width=\"" + Millimetres(raster.width_mm) + "\" height=\"" + Millimetres(raster.height_mm) +
             "\" preserveAspectRatio=\"none\" href=\"data:image/png;base64," + absl::Base64Escape(*png) + "\"/>";
    return absl::OkStatus();
  }

 private:
  std::string& html_;
};

}  // namespace

std::string Escaped(std::string_view text) {
  std::string escaped;
  escaped.reserve(text.size());
  for (const char c : text) switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      case '\'':
        escaped += "&#39;";
        break;
      default:
        escaped += c;
    }
  return escaped;
}

absl::Status AppendSvg(const Drawing& drawing, std::string_view alt, std::string* html) {
  const std::string width = Millimetres(drawing.width_mm), height = Millimetres(drawing.height_mm);
  *html += "<svg role=\"img\" aria-label=\"" + Escaped(alt) + "\" viewBox=\"0 0 " + width + " " + height +
           "\" style=\"width:" + width + "mm\">";
  SvgWriter writer(html);
  for (const Shape& shape : drawing.shapes)
    if (absl::Status status = std::visit(writer, shape); !status.ok()) return status;
  *html += "</svg>";
  return absl::OkStatus();
}

}  // namespace sixpoint::report

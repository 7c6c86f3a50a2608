// A drawing as a list of lines, circles, texts and pictures: one list for HTML (svg.h) and PDF (pdf_drawing.cc), so that both show the same.
//
// mm on paper, x to the right, y down, from the upper left corner. What lies outside width and height is cut off.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "report/colour_scale.h"
#include "report/picture.h"

namespace sixpoint::report {

struct Place {
  double x_mm = 0, y_mm = 0;
};

struct Pen {
  Colour colour;
  double width_mm = 0.2;
  double dash_mm = 0;  // 0: a whole line
};

struct Path {
  std::vector<Place> places;
  bool closed = false;
  std::optional<Pen> pen;
  std::optional<Colour> fill;
};

struct Disc {
  Place centre;
  double radius_mm = 0;
  std::optional<Pen> pen;
  std::optional<Colour> fill;
};

enum class Anchor { kStart, kMiddle, kEnd };

struct Label {
  Place at;  // on the base line
  std::string text;
  double size_mm = 2.4;  // of a line
  Anchor anchor = Anchor::kStart;
  bool bold = false;
  Colour colour;
};

struct Raster {
  Place corner;  // upper left
  double width_mm = 0, height_mm = 0;
  std::shared_ptr<const Picture> picture;
};

using Shape = std::variant<Path, Disc, Label, Raster>;

struct Drawing {
  double width_mm = 0, height_mm = 0;
  std::vector<Shape> shapes;

  void Line(Place from, Place to, const Pen& pen) { shapes.emplace_back(Path{{from, to}, false, pen, std::nullopt}); }
  void Box(Place corner, double box_width_mm, double box_height_mm, std::optional<Pen> pen, std::optional<Colour> fill);
  // A line with a filled head at its end, which is as long as the line where that is short.
  void Arrow(Place from, Place to, const Pen& pen, double head_mm);
  void Text(Place at, std::string text, double size_mm, Colour colour, Anchor anchor = Anchor::kStart,
            bool bold = false) {
    shapes.emplace_back(Label{at, std::move(text), size_mm, anchor, bold, colour});
  }
};

// Colours of a page, dark enough to be read on white.
inline constexpr Colour kInk{28, 34, 40}, kQuietInk{98, 107, 116}, kRule{206, 211, 216}, kPaper{255, 255, 255};
inline constexpr Colour kGoodInk{20, 104, 56}, kBadInk{170, 22, 34}, kOpenInk{140, 84, 0}, kMissingInk{74, 82, 92};

// A line of so many mm that is 1, 2 or 5 times a power of ten, at most `longest_mm`.
double RoundLength(double longest_mm);
// The same in finer steps: 1, 1.5, 2, 2.5, 3, 4, 5, 6, 8.
double RoundMagnification(double greatest);

// With its length beside it; part_scale: mm on paper for a mm of the part.
void DrawScaleBar(Drawing* drawing, Place left, double longest_mm, double part_scale);

}  // namespace sixpoint::report

// What a report tells, in the order of its pages: texts, tables and drawings, without a format. Both writers write this and nothing else; so
// they tell the same.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "report/drawing.h"

namespace sixpoint::report {

// How a text is told besides its words, which say it too.
enum class Tone { kPlain, kQuiet, kGood, kBad, kOpen, kMissing };
Colour ColourOf(Tone tone);

struct Heading {
  std::string text;
  int level = 2;  // 2, or 3 of a part of it
};

struct Paragraph {
  std::string text;
  Tone tone = Tone::kPlain;
};

// The verdict of the whole.
struct Banner {
  Tone tone = Tone::kMissing;
  std::string mark, word, rule, counts;
};

struct Fact {
  std::string label, value;
  Tone tone = Tone::kPlain;
};
inline constexpr const char* kBlank = "\u00a0";  // a value that is still to be written by hand, on a line

// Side by side in so many columns.
struct Facts {
  int columns = 4;
  std::vector<Fact> facts;
};

struct Cell {
  std::string text;
  Tone tone = Tone::kPlain;
  std::optional<Drawing> drawing = std::nullopt;  // instead of a text; alt is its text
};

enum class Align { kLeft, kRight, kCentre };

// Whether a cell's text stays on one line: numbers with their unit, and short texts, but for the words that any column may hold.
bool StaysOnOneLine(const std::string& text, Align align);

struct Column {
  std::string title, unit;  // the unit in the header; empty: none
  Align align = Align::kLeft;
};

struct Table {
  std::string caption;
  std::vector<Column> columns;
  std::vector<std::vector<Cell>> rows;  // a cell a column; the first names the row
  std::string empty;                    // said where there is no row
};

struct Figure {
  Drawing drawing;
  std::string alt, caption;
};
// In a row, as wide as they are drawn.
struct Figures {
  std::vector<Figure> figures;
};

// The next block begins a page.
struct PageBreak {};

using Block = std::variant<Heading, Paragraph, Banner, Facts, Table, Figures, PageBreak>;

struct Document {
  std::string title, subtitle, running;  // running: at every page's head
  std::chrono::system_clock::time_point date;
  bool landscape = false;
  std::vector<Block> blocks;
};

inline constexpr double kPortraitWidth_mm = 178;  // between the margins
inline constexpr double kLandscapeWidth_mm = 269;

}  // namespace sixpoint::report

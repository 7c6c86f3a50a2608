#include <algorithm>

#include "report/pdf_flow.h"

namespace sixpoint::report {
namespace {

const Font kCell{7}, kCellStrong{7, true}, kUnit{6.2}, kCaption{8.5, true};
constexpr double kPad_mm = 1.1, kAbove_mm = 0.8;

const Font& FontOf(Tone tone) {
  return tone == Tone::kGood || tone == Tone::kBad || tone == Tone::kOpen ? kCellStrong : kCell;
}

// Where a text of a column begins, ends or has its middle.
double Edge(Align align, double left_mm, double width_mm) {
  return align == Align::kLeft    ? left_mm + kPad_mm
         : align == Align::kRight ? left_mm + width_mm - kPad_mm
                                  : left_mm + width_mm / 2;
}

Anchor AnchorOf(Align align) {
  return align == Align::kLeft ? Anchor::kStart : align == Align::kRight ? Anchor::kEnd : Anchor::kMiddle;
}

}  // namespace

struct PdfFlow::RowText {
  std::vector<std::vector<std::string>> lines;  // of each cell
  double height_mm = 0;
};

// Each as wide as its longest word, numbers and short texts in one line; what is left by how much more a column's texts would take.
std::vector<double> PdfFlow::ColumnWidths(const Table& table) {
  constexpr std::size_t kLooked = 500;  // of a long table's rows the first ones say how wide it is
  const double most_mm = 0.3 * room_mm();
  std::vector<double> least, full;
  for (std::size_t i = 0; i < table.columns.size(); ++i) {
    double word_mm = 2, text_mm = 2;
    const auto look = [&](const std::string& text, const Font& font) {
      const double width_mm = file_.TextWidth(text, font);
      text_mm = std::max(text_mm, width_mm);
      const bool one_line = StaysOnOneLine(text, table.columns[i].align);
      if (one_line) word_mm = std::max(word_mm, width_mm);
      for (std::size_t begin = 0; !one_line && begin < text.size();) {
        const std::size_t end = std::min(text.find(' ', begin), text.size());
        word_mm = std::max(word_mm, std::min(most_mm, file_.TextWidth(text.substr(begin, end - begin), font)));
        begin = end + 1;
      }
    };
    word_mm = std::max(word_mm, file_.TextWidth(table.columns[i].unit, kUnit));
    look(table.columns[i].title, kCell);
    for (std::size_t r = 0; r < std::min(kLooked, table.rows.size()); ++r) {
      const Cell& cell = table.rows[r][i];
      if (cell.drawing)
        word_mm = std::max(word_mm, cell.drawing->width_mm), text_mm = std::max(text_mm, word_mm);
      else
        look(cell.text, FontOf(cell.tone));
    }
    constexpr double kRoom_mm = 0.3;  // against rounding
    least.push_back(word_mm + 2 * kPad_mm + kRoom_mm);
    full.push_back(std::max(least.back(), std::min(text_mm + 2 * kPad_mm + kRoom_mm, 0.6 * room_mm())));
  }
  double sum_least = 0, sum_more = 0;
  for (std::size_t i = 0; i < least.size(); ++i) sum_least += least[i], sum_more += full[i] - least[i];
  const double left_over_mm = room_mm() - sum_least;
  for (std::size_t i = 0; i < least.size(); ++i) {
    if (left_over_mm < 0)
      least[i] *= room_mm() / sum_least;
    else if (sum_more > left_over_mm)
      least[i] += left_over_mm * (full[i] - least[i]) / sum_more;
    else
      least[i] = full[i] + (left_over_mm - sum_more) / static_cast<double>(least.size());
  }
  return least;
}

PdfFlow::RowText PdfFlow::Lay(const Table& table, const std::vector<double>& widths, const std::vector<Cell>& row) {
  RowText text;
  for (std::size_t i = 0; i < table.columns.size() && i < row.size(); ++i) {
    const Cell& cell = row[i];
    double height_mm = cell.drawing ? cell.drawing->height_mm : 0;
    text.lines.emplace_back();
    if (!cell.drawing) {
      text.lines.back() = file_.Wrapped(cell.text, widths[i] - 2 * kPad_mm, FontOf(cell.tone));
      height_mm = kCell.line_mm() * static_cast<double>(text.lines.back().size());
    }
    text.height_mm = std::max(text.height_mm, height_mm + 2 * kAbove_mm);
  }
  return text;
}

double PdfFlow::HeadHeight(const Table& table, const std::vector<double>& widths) {
  std::size_t lines = 1;
  bool units = false;
  for (std::size_t i = 0; i < table.columns.size(); ++i) {
    lines = std::max(lines, file_.Wrapped(table.columns[i].title, widths[i] - 2 * kPad_mm, kCell).size());
    units = units || !table.columns[i].unit.empty();
  }
  return kCell.line_mm() * static_cast<double>(lines) + (units ? kUnit.line_mm() : 0) + 2 * kAbove_mm;
}

void PdfFlow::DrawHead(const Table& table, const std::vector<double>& widths, bool again) {
  if (!table.caption.empty())
    Lines(file_.Wrapped(table.caption + (again ? ", continued" : ""), room_mm(), kCaption), left_mm(), kCaption, kInk);
  y_mm_ += 0.6;
  const double bottom_mm = y_mm_ + HeadHeight(table, widths);
  bool units = false;
  for (const Column& column : table.columns) units = units || !column.unit.empty();
  double x_mm = left_mm();
  for (std::size_t i = 0; i < table.columns.size(); ++i) {
    const Column& column = table.columns[i];
    const double edge_mm = Edge(column.align, x_mm, widths[i]);
    double base_mm = bottom_mm - kAbove_mm - 0.7;
    if (!column.unit.empty()) file_.Text({edge_mm, base_mm}, column.unit, kUnit, kQuietInk, AnchorOf(column.align));
    if (units) base_mm -= kUnit.line_mm();
    const std::vector<std::string> lines = file_.Wrapped(column.title, widths[i] - 2 * kPad_mm, kCell);
    for (std::size_t k = lines.size(); k-- > 0; base_mm -= kCell.line_mm())
      file_.Text({edge_mm, base_mm}, lines[k], kCell, kQuietInk, AnchorOf(column.align));
    x_mm += widths[i];
  }
  y_mm_ = bottom_mm;
  file_.Line({left_mm(), y_mm_}, {left_mm() + room_mm(), y_mm_}, Pen{kQuietInk, 0.3});
}

void PdfFlow::DrawRow(const Table& table, const std::vector<double>& widths, const std::vector<Cell>& row,
                      const RowText& text) {
  double x_mm = left_mm();
  for (std::size_t i = 0; i < text.lines.size(); ++i) {
    const Cell& cell = row[i];
    const Align align = table.columns[i].align;
    if (cell.drawing) {
      file_.Draw(*cell.drawing, {x_mm + (widths[i] - cell.drawing->width_mm) / 2,
                                 y_mm_ + (text.height_mm - cell.drawing->height_mm) / 2});
    }
    double base_mm = y_mm_ + kAbove_mm + 0.78 * kCell.line_mm();
    for (const std::string& line : text.lines[i]) {
      file_.Text({Edge(align, x_mm, widths[i]), base_mm}, line, FontOf(cell.tone), ColourOf(cell.tone),
                 AnchorOf(align));
      base_mm += kCell.line_mm();
    }
    x_mm += widths[i];
  }
  y_mm_ += text.height_mm;
  file_.Line({left_mm(), y_mm_}, {left_mm() + room_mm(), y_mm_}, Pen{kRule, 0.15});
}

void PdfFlow::operator()(const Table& table) {
  const std::vector<double> widths = ColumnWidths(table);
  const double head_mm = HeadHeight(table, widths) + 2 * kCaption.line_mm() + 1;
  // A head with three rows at least, or with all that there are.
  Need(head_mm + 4.6 * static_cast<double>(std::min<std::size_t>(3, std::max<std::size_t>(1, table.rows.size()))));
  DrawHead(table, widths, false);
  if (table.rows.empty()) {
    y_mm_ += kAbove_mm;
    Lines({table.empty.empty() ? "Nothing." : table.empty}, left_mm() + kPad_mm, kCell, kMissingInk);
  }
  for (const std::vector<Cell>& row : table.rows) {
    const RowText text = Lay(table, widths, row);
    if (Need(text.height_mm)) DrawHead(table, widths, true);
    DrawRow(table, widths, row, text);
  }
  y_mm_ += 4;
}

}  // namespace sixpoint::report

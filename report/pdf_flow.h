// Puts a document's blocks onto pages, one below the other.
#pragma once

#include <string>

#include "report/document.h"
#include "report/pdf_file.h"

namespace sixpoint::report {

class PdfFlow {
 public:
  PdfFlow(PdfFile* file, const Document& document);

  void operator()(const Heading& heading);
  void operator()(const Paragraph& paragraph);
  void operator()(const Banner& banner);
  void operator()(const Facts& facts);
  void operator()(const Table& table);
  void operator()(const Figures& figures);
  void operator()(const PageBreak& page_break);

  // Titles, and "page i of n" on all pages.
  void End();

 private:
  double left_mm() const;
  double room_mm() const;  // between the margins
  double bottom_mm() const;
  void BeginPage();
  // A new page where so much is not left on this one; false: there was.
  bool Need(double height_mm);
  void Lines(const std::vector<std::string>& lines, double x_mm, const Font& font, Colour colour);

  struct RowText;
  std::vector<double> ColumnWidths(const Table& table);
  RowText Lay(const Table& table, const std::vector<double>& widths, const std::vector<Cell>& row);
  void DrawHead(const Table& table, const std::vector<double>& widths, bool again);
  void DrawRow(const Table& table, const std::vector<double>& widths, const std::vector<Cell>& row,
               const RowText& text);
  double HeadHeight(const Table& table, const std::vector<double>& widths);

  PdfFile& file_;
  const Document& document_;
  double y_mm_ = 0;
};

}  // namespace sixpoint::report

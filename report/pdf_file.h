// A PDF file that is being drawn: mm from a page's upper left corner. libharu behind it: its errors are kept, and told by Finish.
#pragma once

#include <absl/status/statusor.h>

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "report/drawing.h"
#include "report/pdf.h"

namespace sixpoint::report {

struct Font {
  double size_pt = 8.5;
  bool bold = false;
  double line_mm() const { return 1.32 * size_pt * 0.352778; }
};

class PdfFile {
 public:
  static absl::StatusOr<std::unique_ptr<PdfFile>> Create(const PdfOptions& options, bool landscape);
  ~PdfFile();
  PdfFile(const PdfFile&) = delete;
  PdfFile& operator=(const PdfFile&) = delete;

  void SetInfo(const std::string& title, const std::string& subject, std::chrono::system_clock::time_point date);
  // Past kMostPages it draws no more, and Finish says so.
  void NewPage();
  std::size_t page_count() const;
  // Draws on an earlier one again.
  void GoToPage(std::size_t page);
  void Bookmark(const std::string& title);

  double width_mm() const;
  double height_mm() const;

  double TextWidth(const std::string& text, const Font& font);
  // No line is wider; a word that is, is broken. One line at least.
  std::vector<std::string> Wrapped(const std::string& text, double width_mm, const Font& font);
  // at: on the base line.
  void Text(Place at, const std::string& text, const Font& font, Colour colour, Anchor anchor = Anchor::kStart);
  void Line(Place from, Place to, const Pen& pen);
  void Box(Place corner, double width_mm, double height_mm, Colour fill);
  void Draw(const Drawing& drawing, Place corner);

  absl::StatusOr<std::string> Finish();

 private:
  struct State;
  explicit PdfFile(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace sixpoint::report

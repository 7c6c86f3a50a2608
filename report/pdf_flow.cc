#include "report/pdf_flow.h"

#include <algorithm>

#include "report/number_text.h"
#include "report/pdf.h"
#include "report/tell.h"

namespace sixpoint::report {
namespace {

constexpr double kLeft_mm = 16, kTop_mm = 13, kFirst_mm = 24, kBottom_mm = 15;
constexpr double kBetween_mm = 3.2;
const Font kBody{8.5}, kSmall{7}, kSmallest{6.6}, kTitle{15, true}, kHead{11, true}, kLower{9, true};

}  // namespace

PdfFlow::PdfFlow(PdfFile* file, const Document& document) : file_(*file), document_(document) { BeginPage(); }

double PdfFlow::left_mm() const { return kLeft_mm; }
double PdfFlow::room_mm() const { return file_.width_mm() - 2 * kLeft_mm; }
double PdfFlow::bottom_mm() const { return file_.height_mm() - kBottom_mm; }

void PdfFlow::BeginPage() {
  file_.NewPage();
  y_mm_ = file_.page_count() == 1 ? kFirst_mm : kTop_mm + 6;
}

bool PdfFlow::Need(double height_mm) {
  if (y_mm_ + height_mm <= bottom_mm()) return false;
  BeginPage();
  return true;
}

void PdfFlow::Lines(const std::vector<std::string>& lines, double x_mm, const Font& font, Colour colour) {
  for (const std::string& line : lines) {
    file_.Text({x_mm, y_mm_ + 0.78 * font.line_mm()}, line, font, colour);
    y_mm_ += font.line_mm();
  }
}

void PdfFlow::operator()(const Heading& heading) {
  const Font& font = heading.level == 2 ? kHead : kLower;
  // With what follows it: a heading alone at a page's end helps nobody.
  Need(font.line_mm() + 30);
  y_mm_ += 3;
  if (heading.level == 2) file_.Bookmark(heading.text);
  Lines(file_.Wrapped(heading.text, room_mm(), font), left_mm(), font, kInk);
  y_mm_ += 1.5;
}

void PdfFlow::operator()(const Paragraph& paragraph) {
  const std::vector<std::string> lines = file_.Wrapped(paragraph.text, room_mm(), kBody);
  Need(kBody.line_mm() * static_cast<double>(lines.size()) + kBetween_mm);
  Lines(lines, left_mm(), kBody, ColourOf(paragraph.tone));
  y_mm_ += kBetween_mm;
}

void PdfFlow::operator()(const Banner& banner) {
  const Font word{17, true};
  const std::string verdict = banner.mark + " " + banner.word;
  const double word_mm = file_.TextWidth(verdict, word), text_left_mm = left_mm() + 7 + word_mm + 7;
  const double text_mm = left_mm() + room_mm() - 3 - text_left_mm;
  const std::vector<std::string> counts = file_.Wrapped(banner.counts, text_mm, kBody);
  const std::vector<std::string> rule = file_.Wrapped(banner.rule, text_mm, kSmall);
  const double lines_mm =
      kBody.line_mm() * static_cast<double>(counts.size()) + kSmall.line_mm() * static_cast<double>(rule.size());
  const double height_mm = std::max(14.0, lines_mm + 5);
  Need(height_mm + kBetween_mm);
  const double top_mm = y_mm_;
  file_.Box({left_mm(), top_mm}, room_mm(), height_mm, {246, 247, 248});
  file_.Box({left_mm(), top_mm}, 2, height_mm, ColourOf(banner.tone));
  file_.Text({left_mm() + 7, top_mm + height_mm / 2 + 2.2}, verdict, word, ColourOf(banner.tone));
  y_mm_ = top_mm + (height_mm - lines_mm) / 2;
  Lines(counts, text_left_mm, kBody, kInk);
  Lines(rule, text_left_mm, kSmall, kQuietInk);
  y_mm_ = top_mm + height_mm + kBetween_mm;
}

void PdfFlow::operator()(const Facts& facts) {
  const double gap_mm = 5, width_mm = (room_mm() + gap_mm) / facts.columns - gap_mm;
  const std::size_t columns = static_cast<std::size_t>(facts.columns);
  for (std::size_t begin = 0; begin < facts.facts.size(); begin += columns) {
    const std::size_t end = std::min(begin + columns, facts.facts.size());
    std::vector<std::vector<std::string>> values;
    std::size_t lines = 1;
    for (std::size_t i = begin; i < end; ++i) {
      values.push_back(file_.Wrapped(facts.facts[i].value, width_mm, kBody));
      lines = std::max(lines, values.back().size());
    }
    const double height_mm = kSmallest.line_mm() + kBody.line_mm() * static_cast<double>(lines) + 1.4;
    Need(height_mm);
    const double top_mm = y_mm_;
    for (std::size_t i = begin; i < end; ++i) {
      const double x_mm = left_mm() + static_cast<double>(i - begin) * (width_mm + gap_mm);
      y_mm_ = top_mm;
      Lines({facts.facts[i].label}, x_mm, kSmallest, kQuietInk);
      Lines(values[i - begin], x_mm, kBody, ColourOf(facts.facts[i].tone));
      if (facts.facts[i].value == kBlank)
        file_.Line({x_mm, y_mm_ - 0.4}, {x_mm + width_mm, y_mm_ - 0.4}, Pen{kQuietInk, 0.12});
    }
    y_mm_ = top_mm + height_mm;
  }
  y_mm_ += kBetween_mm - 1.4;
}

void PdfFlow::operator()(const Figures& figures) {
  double drawn_mm = 0, height_mm = 0;
  std::vector<std::vector<std::string>> captions;
  for (const Figure& figure : figures.figures) {
    captions.push_back(file_.Wrapped(figure.caption, figure.drawing.width_mm, kSmall));
    drawn_mm += figure.drawing.width_mm;
    height_mm = std::max(height_mm,
                         figure.drawing.height_mm + 1 + kSmall.line_mm() * static_cast<double>(captions.back().size()));
  }
  Need(height_mm);
  const double top_mm = y_mm_;
  const std::size_t gaps = figures.figures.size() - 1;
  const double gap_mm = gaps == 0 ? 0 : std::max(0.0, room_mm() - drawn_mm) / static_cast<double>(gaps);
  double x_mm = left_mm();
  for (std::size_t i = 0; i < figures.figures.size(); ++i) {
    const Drawing& drawing = figures.figures[i].drawing;
    file_.Draw(drawing, {x_mm, top_mm});
    y_mm_ = top_mm + drawing.height_mm + 1;
    Lines(captions[i], x_mm, kSmall, kQuietInk);
    x_mm += drawing.width_mm + gap_mm;
  }
  y_mm_ = top_mm + height_mm + kBetween_mm;
}

void PdfFlow::operator()(const PageBreak&) { BeginPage(); }

void PdfFlow::End() {
  const std::size_t count = file_.page_count();
  for (std::size_t page = 0; page < count; ++page) {
    file_.GoToPage(page);
    const double right_mm = left_mm() + room_mm(), foot_mm = file_.height_mm() - 8;
    if (page == 0) {
      const Font sub{8};
      const std::vector<std::string> title = file_.Wrapped(document_.title, 0.62 * room_mm(), kTitle);
      file_.Text({left_mm(), 18}, title.front() + (title.size() > 1 ? "..." : ""), kTitle, kInk);
      const auto one_line = [&](const std::string& text) {
        const std::vector<std::string> lines = file_.Wrapped(text, 0.36 * room_mm(), sub);
        return lines.front() + (lines.size() > 1 ? "..." : "");
      };
      file_.Text({right_mm, 14}, one_line(document_.subtitle), sub, kQuietInk, Anchor::kEnd);
      file_.Text({right_mm, 18}, one_line(document_.running), sub, kQuietInk, Anchor::kEnd);
      file_.Line({left_mm(), 20.8}, {right_mm, 20.8}, Pen{kInk, 0.5});
    } else {
      const auto half = [&](const std::string& text) {
        const std::vector<std::string> lines = file_.Wrapped(text, 0.48 * room_mm(), kSmall);
        return lines.front() + (lines.size() > 1 ? "..." : "");
      };
      file_.Text({left_mm(), kTop_mm}, half(document_.title), kSmall, kQuietInk);
      file_.Text({right_mm, kTop_mm}, half(document_.running), kSmall, kQuietInk, Anchor::kEnd);
      file_.Line({left_mm(), kTop_mm + 1.8}, {right_mm, kTop_mm + 1.8}, Pen{kRule, 0.2});
    }
    file_.Text({left_mm(), foot_mm}, TimeWords(document_.date), kSmall, kQuietInk);
    file_.Text({right_mm, foot_mm}, "page " + std::to_string(page + 1) + " of " + std::to_string(count), kSmall,
               kQuietInk, Anchor::kEnd);
  }
}

absl::StatusOr<std::string> ToPdf(const Document& document, const PdfOptions& options) {
  absl::StatusOr<std::unique_ptr<PdfFile>> file = PdfFile::Create(options, document.landscape);
  if (!file.ok()) return file.status();
  (*file)->SetInfo(document.title, document.running, document.date);
  PdfFlow flow(file->get(), document);
  for (const Block& block : document.blocks) std::visit(flow, block);
  flow.End();
  return (*file)->Finish();
}

absl::StatusOr<std::string> WritePdf(const Report& report, const PdfOptions& options) {
  const absl::StatusOr<Document> document = Tell(report);
  if (!document.ok()) return document.status();
  return ToPdf(*document, options);
}

}  // namespace sixpoint::report

#include "report/pdf_file.h"

#include <hpdf.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <map>

#include "report/font_file.h"
#include "report/number_text.h"
#include "report/pdf_text.h"
#include "report/tell.h"

namespace sixpoint::report {

// Named, for PdfFile::State has them.
struct PdfFault {
  HPDF_STATUS error = 0, detail = 0;
};

struct PdfFace {
  HPDF_Font font = nullptr;
  std::vector<bool> has;
  std::vector<float> widths = std::vector<float>(65536, -1);  // parts of the size; below 0: not asked yet
};

namespace {

constexpr double kPoint_mm = 0.352778;

// The first one counts. Nothing is thrown or jumped out of C: libharu gives up by itself, and every later call of it does nothing.
void Keep(HPDF_STATUS error, HPDF_STATUS detail, void* data) {
  PdfFault& fault = *static_cast<PdfFault*>(data);
  if (fault.error == 0) fault = {error, detail};
}

absl::Status StatusOf(const PdfFault& fault) {
  if (fault.error == 0) return absl::OkStatus();
  char text[64];
  std::snprintf(text, sizeof text, "libharu gave up with error 0x%04lx, detail %lu", fault.error, fault.detail);
  return absl::ResourceExhaustedError(text);
}

HPDF_REAL Points(double mm) { return static_cast<HPDF_REAL>(mm / kPoint_mm); }

}  // namespace

struct PdfFile::State {
  ~State() {
    if (pdf) HPDF_Free(pdf);
  }
  PdfFault fault;
  HPDF_Doc pdf = nullptr;
  std::array<PdfFace, 2> faces;  // regular, bold
  bool landscape = false, too_many = false;
  std::vector<HPDF_Page> pages;
  HPDF_Page page = nullptr;
  std::map<const Picture*, HPDF_Image> images;

  HPDF_REAL Down(double y_mm) const { return Points((landscape ? 210 : 297) - y_mm); }
  void Stroke(const Pen& pen) const {
    HPDF_Page_SetRGBStroke(page, pen.colour.r / 255.f, pen.colour.g / 255.f, pen.colour.b / 255.f);
    HPDF_Page_SetLineWidth(page, Points(pen.width_mm));
    const auto dash = static_cast<HPDF_UINT16>(std::max(1.0, std::round(pen.dash_mm / kPoint_mm)));
    if (pen.dash_mm > 0)
      HPDF_Page_SetDash(page, &dash, 1, 0);
    else
      HPDF_Page_SetDash(page, nullptr, 0, 0);
  }
  void Fill(Colour c) const { HPDF_Page_SetRGBFill(page, c.r / 255.f, c.g / 255.f, c.b / 255.f); }
  void Paint(const std::optional<Pen>& pen, const std::optional<Colour>& fill) const {
    if (pen && fill)
      HPDF_Page_FillStroke(page);
    else if (pen)
      HPDF_Page_Stroke(page);
    else if (fill)
      HPDF_Page_Fill(page);
    else
      HPDF_Page_EndPath(page);
  }
  // What is shown are characters that the font has: below 65536.
  double WidthOf(char32_t code, const Font& font) {
    PdfFace& face = faces[font.bold ? 1 : 0];
    float& width = face.widths.at(code);
    if (width < 0)
      width = static_cast<float>(HPDF_Font_GetUnicodeWidth(face.font, static_cast<HPDF_UNICODE>(code))) / 1000;
    return width * font.size_pt * kPoint_mm;
  }
  double WidthOf(const std::vector<char32_t>& codes, const Font& font) {
    double width_mm = 0;
    for (const char32_t code : codes) width_mm += WidthOf(code, font);
    return width_mm;
  }
};

PdfFile::PdfFile(std::unique_ptr<State> state) : state_(std::move(state)) {}
PdfFile::~PdfFile() = default;

absl::StatusOr<std::unique_ptr<PdfFile>> PdfFile::Create(const PdfOptions& options, bool landscape) {
  auto state = std::make_unique<State>();
  state->landscape = landscape;
  const std::array<std::string, 2> paths = {options.font_folder + "/DejaVuSans.ttf",
                                            options.font_folder + "/DejaVuSans-Bold.ttf"};
  for (std::size_t i = 0; i < 2; ++i) {
    absl::StatusOr<std::vector<bool>> has = CharactersOf(paths[i]);
    if (!has.ok()) return has.status();
    state->faces[i].has = *std::move(has);
  }
  state->pdf = HPDF_New(Keep, &state->fault);
  if (!state->pdf) return absl::ResourceExhaustedError("libharu did not begin a file");
  HPDF_SetCompressionMode(state->pdf, HPDF_COMP_ALL);
  HPDF_UseUTFEncodings(state->pdf);
  HPDF_SetCurrentEncoder(state->pdf, "UTF-8");
  for (std::size_t i = 0; i < 2; ++i) {
    const char* name = HPDF_LoadTTFontFromFile(state->pdf, paths[i].c_str(), HPDF_TRUE);
    if (name) state->faces[i].font = HPDF_GetFont(state->pdf, name, "UTF-8");
    if (!state->faces[i].font) return absl::FailedPreconditionError("libharu does not read " + paths[i]);
  }
  if (absl::Status status = StatusOf(state->fault); !status.ok()) return status;
  return std::unique_ptr<PdfFile>(new PdfFile(std::move(state)));
}

void PdfFile::SetInfo(const std::string& title, const std::string& subject,
                      std::chrono::system_clock::time_point date) {
  HPDF_SetInfoAttr(state_->pdf, HPDF_INFO_TITLE, title.c_str());
  HPDF_SetInfoAttr(state_->pdf, HPDF_INFO_SUBJECT, subject.c_str());
  HPDF_SetInfoAttr(state_->pdf, HPDF_INFO_CREATOR, "Sixpoint");
  const std::time_t time = std::chrono::system_clock::to_time_t(date);
  std::tm utc{};
  gmtime_r(&time, &utc);
  // libharu takes no year before 1900 or beyond four digits.
  if (utc.tm_year < 0 || utc.tm_year > 8000) return;
  const HPDF_Date day{
      utc.tm_year + 1900, utc.tm_mon + 1, utc.tm_mday, utc.tm_hour, utc.tm_min, utc.tm_sec % 60, 'Z', 0, 0};
  HPDF_SetInfoDateAttr(state_->pdf, HPDF_INFO_CREATION_DATE, day);
  HPDF_SetInfoDateAttr(state_->pdf, HPDF_INFO_MOD_DATE, day);
}

void PdfFile::NewPage() {
  if (state_->pages.size() >= kMostPages) {
    state_->too_many = true;
    return;
  }
  HPDF_Page page = HPDF_AddPage(state_->pdf);
  if (!page) return;
  HPDF_Page_SetSize(page, HPDF_PAGE_SIZE_A4, state_->landscape ? HPDF_PAGE_LANDSCAPE : HPDF_PAGE_PORTRAIT);
  state_->pages.push_back(page);
  state_->page = page;
}

std::size_t PdfFile::page_count() const { return state_->pages.size(); }
void PdfFile::GoToPage(std::size_t page) { state_->page = state_->pages.at(page); }

void PdfFile::Bookmark(const std::string& title) {
  HPDF_Encoder encoder = HPDF_GetEncoder(state_->pdf, "UTF-8");
  HPDF_Outline outline = HPDF_CreateOutline(state_->pdf, nullptr, title.c_str(), encoder);
  HPDF_Destination there = HPDF_Page_CreateDestination(state_->page);
  if (outline && there) HPDF_Outline_SetDestination(outline, there);
}

double PdfFile::width_mm() const { return state_->landscape ? 297 : 210; }
double PdfFile::height_mm() const { return state_->landscape ? 210 : 297; }

double PdfFile::TextWidth(const std::string& text, const Font& font) {
  return state_->WidthOf(Shown(text, state_->faces[font.bold ? 1 : 0].has), font);
}

std::vector<std::string> PdfFile::Wrapped(const std::string& text, double width_mm, const Font& font) {
  const std::vector<char32_t> codes = Shown(text, state_->faces[font.bold ? 1 : 0].has);
  std::vector<std::string> lines;
  std::size_t begin = 0;
  const auto put = [&](std::size_t end) {
    std::string line;
    for (std::size_t i = begin; i < end; ++i) AppendUtf8(codes[i], &line);
    lines.push_back(std::move(line));
  };
  double used_mm = 0;
  std::size_t breakable = 0;  // where a line may end: behind a blank, or a mark within a name
  for (std::size_t i = 0; i < codes.size(); ++i) {
    const double wide_mm = state_->WidthOf(codes[i], font);
    if (i > begin && codes[i] != U' ' && used_mm + wide_mm > width_mm) {
      const std::size_t end = breakable > begin ? breakable : i;
      put(end);
      begin = end;
      used_mm = 0;
      for (std::size_t k = begin; k < i; ++k) used_mm += state_->WidthOf(codes[k], font);
    }
    used_mm += wide_mm;
    if (codes[i] == U' ' || codes[i] == U'/' || codes[i] == U'-' || codes[i] == U'_') breakable = i + 1;
  }
  put(codes.size());
  return lines;
}

void PdfFile::Text(Place at, const std::string& text, const Font& font, Colour colour, Anchor anchor) {
  PdfFace& face = state_->faces[font.bold ? 1 : 0];
  const std::vector<char32_t> codes = InOrderOfSight(Shown(text, face.has));
  if (codes.empty()) return;
  std::string shown;
  for (const char32_t code : codes) AppendUtf8(code, &shown);
  const double width_mm = anchor == Anchor::kStart ? 0 : state_->WidthOf(codes, font);
  const double x_mm = at.x_mm - (anchor == Anchor::kMiddle ? width_mm / 2 : width_mm);
  state_->Fill(colour);
  HPDF_Page_BeginText(state_->page);
  HPDF_Page_SetFontAndSize(state_->page, face.font, static_cast<HPDF_REAL>(font.size_pt));
  HPDF_Page_TextOut(state_->page, Points(x_mm), state_->Down(at.y_mm), shown.c_str());
  HPDF_Page_EndText(state_->page);
}

void PdfFile::Line(Place from, Place to, const Pen& pen) {
  state_->Stroke(pen);
  HPDF_Page_MoveTo(state_->page, Points(from.x_mm), state_->Down(from.y_mm));
  HPDF_Page_LineTo(state_->page, Points(to.x_mm), state_->Down(to.y_mm));
  HPDF_Page_Stroke(state_->page);
}

void PdfFile::Box(Place corner, double width_mm, double height_mm, Colour fill) {
  state_->Fill(fill);
  HPDF_Page_Rectangle(state_->page, Points(corner.x_mm), state_->Down(corner.y_mm + height_mm), Points(width_mm),
                      Points(height_mm));
  HPDF_Page_Fill(state_->page);
}

namespace {

// Within what libharu writes: places far outside of a drawing are clipped anyway.
Place Near(Place corner, Place p) {
  return {corner.x_mm + std::clamp(p.x_mm, -2000.0, 2000.0), corner.y_mm + std::clamp(p.y_mm, -2000.0, 2000.0)};
}

}  // namespace

void PdfFile::Draw(const Drawing& drawing, Place corner) {
  State& s = *state_;
  HPDF_Page_GSave(s.page);
  HPDF_Page_Rectangle(s.page, Points(corner.x_mm), s.Down(corner.y_mm + drawing.height_mm), Points(drawing.width_mm),
                      Points(drawing.height_mm));
  HPDF_Page_Clip(s.page);
  HPDF_Page_EndPath(s.page);
  for (const Shape& shape : drawing.shapes) {
    if (const Path* path = std::get_if<Path>(&shape)) {
      if (path->places.size() < 2 || !(path->pen || path->fill)) continue;
      if (path->pen) s.Stroke(*path->pen);
      if (path->fill) s.Fill(*path->fill);
      for (std::size_t i = 0; i < path->places.size(); ++i) {
        const Place p = Near(corner, path->places[i]);
        (i == 0 ? HPDF_Page_MoveTo : HPDF_Page_LineTo)(s.page, Points(p.x_mm), s.Down(p.y_mm));
      }
      if (path->closed) HPDF_Page_ClosePath(s.page);
      s.Paint(path->pen, path->fill);
    } else if (const Disc* disc = std::get_if<Disc>(&shape)) {
      const Place p = Near(corner, disc->centre);
      if (!(disc->radius_mm > 0) || !(disc->pen || disc->fill)) continue;
      if (disc->pen) s.Stroke(*disc->pen);
      if (disc->fill) s.Fill(*disc->fill);
      HPDF_Page_Circle(s.page, Points(p.x_mm), s.Down(p.y_mm), Points(std::min(disc->radius_mm, 2000.0)));
      s.Paint(disc->pen, disc->fill);
    } else if (const Label* label = std::get_if<Label>(&shape)) {
      Text(Near(corner, label->at), label->text, {label->size_mm / kPoint_mm, label->bold}, label->colour,
           label->anchor);
    } else if (const Raster* raster = std::get_if<Raster>(&shape)) {
      HPDF_Image& image = s.images[raster->picture.get()];
      if (!image)
        image = HPDF_LoadRawImageFromMem(s.pdf, raster->picture->rgb.data(),
                                         static_cast<HPDF_UINT>(raster->picture->width_px),
                                         static_cast<HPDF_UINT>(raster->picture->height_px), HPDF_CS_DEVICE_RGB, 8);
      if (!image) continue;
      const Place p = Near(corner, raster->corner);
      HPDF_Page_DrawImage(s.page, image, Points(p.x_mm), s.Down(p.y_mm + raster->height_mm), Points(raster->width_mm),
                          Points(raster->height_mm));
    }
  }
  HPDF_Page_GRestore(s.page);
}

absl::StatusOr<std::string> PdfFile::Finish() {
  if (state_->too_many) return absl::ResourceExhaustedError("more than " + std::to_string(kMostPages) + " pages");
  if (absl::Status status = StatusOf(state_->fault); !status.ok()) return status;
  HPDF_SaveToStream(state_->pdf);
  HPDF_UINT32 left = HPDF_GetStreamSize(state_->pdf);
  std::string bytes(left, '\0');
  HPDF_ResetStream(state_->pdf);
  std::size_t read = 0;
  while (read < bytes.size()) {
    auto count = static_cast<HPDF_UINT32>(bytes.size() - read);
    HPDF_ReadFromStream(state_->pdf, reinterpret_cast<HPDF_BYTE*>(bytes.data()) + read, &count);
    if (count == 0) break;
    read += count;
  }
  if (absl::Status status = StatusOf(state_->fault); !status.ok()) return status;
  if (read == 0 || read != bytes.size()) return absl::ResourceExhaustedError("libharu wrote a file in part");
  return bytes;
}

}  // namespace sixpoint::report

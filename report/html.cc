#include "report/html.h"

#include "report/number_text.h"
#include "report/svg.h"
#include "report/tell.h"

namespace sixpoint::report {
namespace {

// No rule names anything outside the file.
constexpr std::string_view kStyle = R"(
@page{size:A4;margin:11mm 16mm}
*{box-sizing:border-box}
body{margin:0;background:#eef0f2;color:#1c2228;font:9.5pt/1.42 "DejaVu Sans",Verdana,"Segoe UI",Arial,sans-serif;font-variant-numeric:tabular-nums}
main{max-width:210mm;margin:8mm auto;padding:14mm 16mm;background:#fff}
.any,dd,p,caption,h1{overflow-wrap:anywhere}.one{white-space:nowrap}
.wide main{max-width:297mm}
header{display:flex;justify-content:space-between;align-items:baseline;gap:8mm;border-bottom:.5mm solid #1c2228;padding-bottom:2mm}
h1{font-size:16pt;line-height:1.2;margin:0;font-weight:700}
header p{margin:0;color:#626b74;text-align:right}
h2{font-size:12pt;margin:9mm 0 2mm;break-after:avoid}h3{font-size:10pt;margin:5mm 0 1.5mm;break-after:avoid}
p{margin:2mm 0}
.banner{display:flex;gap:5mm;align-items:center;margin:4mm 0;padding:3mm 5mm;border-left:2mm solid;background:#f6f7f8}
.banner b{font-size:19pt;line-height:1.15;white-space:nowrap}
.banner p{margin:0;color:#1c2228;font-size:9pt;font-weight:400}
.facts{display:grid;gap:1.6mm 6mm;margin:3mm 0}.facts div{min-width:0}
dl,dt,dd{margin:0}dd{font-size:8.8pt}.blank{border-bottom:.15mm solid #98a0a8}dt{color:#626b74;font-size:7.5pt}
figure{margin:0;break-inside:avoid;flex:0 1 auto}
.figures{display:flex;flex-wrap:wrap;justify-content:space-between;gap:4mm;margin:4mm 0;break-inside:avoid}
figcaption{color:#626b74;font-size:7.8pt;margin-top:1mm}
svg{display:block;max-width:100%;height:auto;font-family:"DejaVu Sans",Verdana,Arial,sans-serif}
.scroll{overflow-x:auto;margin:4mm 0 5mm}
table{border-collapse:collapse;width:100%;font-size:7.8pt;line-height:1.35}
caption{caption-side:top;text-align:left;font-weight:700;font-size:9pt;padding-bottom:1.2mm}
thead{display:table-header-group}tr{break-inside:avoid}
th,td{padding:.9mm 1.2mm;text-align:left;vertical-align:top;font-weight:400;unicode-bidi:isolate}
thead th{color:#626b74;border-bottom:.3mm solid #626b74;vertical-align:bottom}
tbody th,tbody td{border-bottom:.15mm solid #ced3d8}
.r{text-align:right}.c{text-align:center}td svg{margin:.4mm auto}
.unit{display:block;color:#626b74}
.quiet{color:#626b74}.good{color:#146838;font-weight:700}.bad{color:#aa1622;font-weight:700}.open{color:#8c5400;font-weight:700}.missing{color:#4a525c;font-style:italic}
.break{break-before:page;border-top:.15mm solid #ced3d8;margin-top:8mm}
@media print{body{background:#fff;font-size:8.6pt;line-height:1.35}dd{font-size:8.2pt}.banner,.facts,.figures{margin:2mm 0}.banner{padding:2mm 5mm}.scroll{margin:2mm 0 3mm}main,.wide main{max-width:none;margin:0;padding:0}.break{border:0;margin:0}.scroll{overflow:visible}*{print-color-adjust:exact;-webkit-print-color-adjust:exact}}
)";

std::string_view ClassOf(Tone tone) {
  switch (tone) {
    case Tone::kQuiet:
      return "quiet";
    case Tone::kGood:
      return "good";
    case Tone::kBad:
      return "bad";
    case Tone::kOpen:
      return "open";
    case Tone::kMissing:
      return "missing";
    case Tone::kPlain:
      break;
  }
  return "";
}

// Short texts stay on one line, long words may break anywhere: a table is never wider than its page.
std::string_view BreaksOf(const std::string& text, Align align) {
  constexpr std::size_t kLongWord = 24;
  if (StaysOnOneLine(text, align)) return "one";
  std::size_t word = 0;
  for (const char c : text) {
    word = c == ' ' ? 0 : word + 1;
    if (word > kLongWord) return "any";
  }
  return "";
}

std::string Class(Tone tone, Align align = Align::kLeft, std::string_view third = "") {
  std::string names(ClassOf(tone));
  const auto add = [&](std::string_view name) {
    names += (names.empty() || name.empty() ? "" : " ") + std::string(name);
  };
  add(align == Align::kLeft ? "" : align == Align::kRight ? "r" : "c");
  add(third);
  return names.empty() ? "" : " class=\"" + names + "\"";
}

class HtmlWriter {
 public:
  absl::Status operator()(const Heading& heading) {
    const std::string tag = heading.level == 2 ? "h2" : "h3";
    html += "<" + tag + ">" + Escaped(heading.text) + "</" + tag + ">\n";
    return absl::OkStatus();
  }

  absl::Status operator()(const Paragraph& paragraph) {
    html += "<p" + Class(paragraph.tone) + ">" + Escaped(paragraph.text) + "</p>\n";
    return absl::OkStatus();
  }

  absl::Status operator()(const Banner& banner) {
    const std::string tone(ClassOf(banner.tone));
    html += "<section class=\"banner " + tone + "\" style=\"font-style:normal\"><b>" + Escaped(banner.mark) + " " +
            Escaped(banner.word) + "</b><div><p>" + Escaped(banner.counts) + "</p><p>" + Escaped(banner.rule) +
            "</p></div></section>\n";
    return absl::OkStatus();
  }

  absl::Status operator()(const Facts& facts) {
    html += "<dl class=\"facts\" style=\"grid-template-columns:repeat(" + std::to_string(facts.columns) + ",1fr)\">";
    for (const Fact& fact : facts.facts)
      html += "<div><dt>" + Escaped(fact.label) + "</dt><dd" +
              Class(fact.tone, Align::kLeft, fact.value == kBlank ? "blank" : "") + ">" + Escaped(fact.value) +
              "</dd></div>";
    html += "</dl>\n";
    return absl::OkStatus();
  }

  absl::Status operator()(const Table& table) {
    html += "<div class=\"scroll\"><table><caption>" + Escaped(table.caption) + "</caption><thead><tr>";
    for (const Column& column : table.columns) {
      html += "<th scope=\"col\"" + Class(Tone::kPlain, column.align, BreaksOf(column.title, Align::kLeft)) + ">" +
              Escaped(column.title);
      if (!column.unit.empty()) html += "<span class=\"unit\">" + Escaped(column.unit) + "</span>";
      html += "</th>";
    }
    html += "</tr></thead><tbody>\n";
    if (table.rows.empty())
      html += "<tr><td class=\"missing\" colspan=\"" + std::to_string(table.columns.size()) + "\">" +
              Escaped(table.empty) + "</td></tr>\n";
    for (const std::vector<Cell>& row : table.rows) {
      html += "<tr>";
      for (std::size_t i = 0; i < row.size(); ++i) {
        html += i == 0 ? "<th scope=\"row\"" : "<td";
        html += Class(row[i].tone, table.columns[i].align,
                      row[i].drawing ? "" : BreaksOf(row[i].text, table.columns[i].align)) +
                ">";
        if (row[i].drawing) {
          if (absl::Status status = AppendSvg(*row[i].drawing, row[i].text, &html); !status.ok()) return status;
        } else {
          html += Escaped(row[i].text);
        }
        html += i == 0 ? "</th>" : "</td>";
      }
      html += "</tr>\n";
    }
    html += "</tbody></table></div>\n";
    return absl::OkStatus();
  }

  absl::Status operator()(const Figures& figures) {
    html += "<div class=\"figures\">";
    for (const Figure& figure : figures.figures) {
      html += "<figure style=\"width:" + std::to_string(static_cast<int>(figure.drawing.width_mm)) + "mm\">";
      if (absl::Status status = AppendSvg(figure.drawing, figure.alt, &html); !status.ok()) return status;
      html += "<figcaption>" + Escaped(figure.caption) + "</figcaption></figure>\n";
    }
    html += "</div>\n";
    return absl::OkStatus();
  }

  absl::Status operator()(const PageBreak&) {
    html += "<div class=\"break\"></div>\n";
    return absl::OkStatus();
  }

  std::string html;
};

}  // namespace

absl::StatusOr<std::string> ToHtml(const Document& document) {
  HtmlWriter writer;
  writer.html = "<!doctype html>\n<html lang=\"en\"" + std::string(document.landscape ? " class=\"wide\"" : "") +
                "><head><meta charset=\"utf-8\">"
                "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; style-src "
                "'unsafe-inline'\"><meta name=\"viewport\" content=\"width=device-width\"><title>" +
                Escaped(document.title) + " \u00b7 " + Escaped(document.running) + "</title><style>" +
                std::string(kStyle) + (document.landscape ? "@page{size:A4 landscape}\n" : "") +
                "</style></head>\n<body><main>\n<header><h1>" + Escaped(document.title) + "</h1><p>" +
                Escaped(document.subtitle) + "<br>" + Escaped(document.running) + "</p></header>\n";
  for (const Block& block : document.blocks)
    if (absl::Status status = std::visit(writer, block); !status.ok()) return status;
  writer.html += "</main></body></html>\n";
  return std::move(writer.html);
}

absl::StatusOr<std::string> WriteHtml(const Report& report) {
  const absl::StatusOr<Document> document = Tell(report);
  if (!document.ok()) return document.status();
  return ToHtml(*document);
}

}  // namespace sixpoint::report

// A report's file as a reader sees it: its texts.
#pragma once

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <string>
#include <string_view>
#include <utility>

#include "report/number_text.h"

namespace sixpoint::report {

// Without blanks of any kind: where lines break is no fact.
inline std::string Packed(std::string_view text) {
  std::string packed;
  for (const char32_t c : CodePoints(text))
    if (c != U' ' && c != U'\n' && c != U'\f' && c != U'\r' && c != U'\u00a0') AppendUtf8(c, &packed);
  return packed;
}

// What a reader sees: tags and style gone, alternative texts kept, entities as their characters.
inline std::string HtmlText(const std::string& html) {
  std::string text;
  bool inside = false;
  std::string tag;
  for (std::size_t i = html.find("</head>"); i < html.size(); ++i) {
    if (html[i] == '<') inside = true, tag.clear();
    if (!inside) text += html[i];
    if (inside) tag += html[i];
    if (html[i] != '>') continue;
    inside = false;
    const std::size_t label = tag.find("aria-label=\"");
    if (label != std::string::npos) text += tag.substr(label + 12, tag.find('"', label + 12) - label - 12);
  }
  for (const auto& [entity, c] :
       {std::pair{"&lt;", "<"}, {"&gt;", ">"}, {"&quot;", "\""}, {"&#39;", "'"}, {"&amp;", "&"}})
    for (std::size_t at; (at = text.find(entity)) != std::string::npos;) text.replace(at, std::strlen(entity), c);
  return Packed(text);
}

inline bool HasPdfToText() { return std::system("command -v pdftotext > /dev/null 2>&1") == 0; }

inline std::string PdfText(const std::string& pdf) {
  const std::string path =
      ::testing::TempDir() + "report_" + ::testing::UnitTest::GetInstance()->current_test_info()->name() + ".pdf";
  std::ofstream(path, std::ios::binary) << pdf;
  FILE* pipe = popen(("pdftotext -raw '" + path + "' - 2>/dev/null").c_str(), "r");
  std::string text;
  char buffer[65536];
  for (std::size_t read; (read = std::fread(buffer, 1, sizeof buffer, pipe)) > 0;) text.append(buffer, read);
  pclose(pipe);
  std::remove(path.c_str());
  return text;
}

}  // namespace sixpoint::report

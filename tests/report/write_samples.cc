// usage: report_samples FOLDER      Writes a made-up vane's report, and its first article's forms, to look at.
#include <fstream>
#include <iostream>

#include "report/html.h"
#include "report/pdf.h"
#include "tests/report/sample_report.h"

namespace {

bool Write(const std::string& path, const absl::StatusOr<std::string>& bytes) {
  if (!bytes.ok()) {
    std::cerr << path << ": " << bytes.status() << "\n";
    return false;
  }
  std::ofstream(path, std::ios::binary) << *bytes;
  std::cout << path << ": " << bytes->size() << " bytes\n";
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace sixpoint::report;
  if (argc != 2) {
    std::cerr << "usage: report_samples FOLDER\n";
    return 2;
  }
  const std::string folder = argv[1];
  const Report report = VaneReport();
  bool good = Write(folder + "/report.html", WriteHtml(report));
  good = Write(folder + "/report.pdf", WritePdf(report)) && good;
  const FirstArticle first_article = VaneFirstArticle();
  good = Write(folder + "/first_article.html", WriteHtml(first_article)) && good;
  good = Write(folder + "/first_article.pdf", WritePdf(first_article)) && good;
  good = Write(folder + "/first_article.json", WriteJson(first_article)) && good;
  return good ? 0 : 1;
}

#include "cli/out_file.h"

#include <filesystem>
#include <iostream>

#include "cli/document.h"
#include "services/runtime/errors.h"

namespace sixpoint::cli {
namespace {

constexpr char kStandardOutput[] = "-";

}  // namespace

Option* AddOutOption(Command* command, std::string* out, const std::string& what) {
  return command->AddOption("-o,--out", out, what + "; - is standard output");
}

absl::Status CheckOut(const Session& session, const std::string& out) {
  if (out == kStandardOutput) {
    return session.json ? runtime::Refuse("--out", out, "a file: --json writes to standard output") : absl::OkStatus();
  }
  const bool has_folder = out.empty() || std::filesystem::is_directory(std::filesystem::absolute(out).parent_path());
  return has_folder ? absl::OkStatus() : runtime::Refuse("--out", out, "a file in a folder that exists");
}

absl::Status WriteOut(const std::string& out, const std::string& content) {
  if (out != kStandardOutput) return WriteFile(out, content);
  std::cout << content << std::flush;
  return absl::OkStatus();
}

std::ostream& BesideOut(const std::string& out) { return out == kStandardOutput ? std::cerr : std::cout; }

std::string CsvCell(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + "\"";
}

std::string OutText(const std::string& out) { return out == kStandardOutput ? "standard output" : out; }

}  // namespace sixpoint::cli

// The contract's reasons, their catalogue in docs/errors.md and the code: each says what the others say.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <string>
#include <vector>

#include "services/runtime/errors.h"
#include "storage/reasons.h"

namespace sixpoint::runtime {
namespace {

std::filesystem::path Source() { return std::getenv("SIXPOINT_SOURCE_DIR"); }

std::string Content(const std::filesystem::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

// All of a folder's C++, but not storage's list, which names its reasons.
std::string CodeUnder(const char* folder) {
  std::string code;
  for (const auto& file : std::filesystem::recursive_directory_iterator(Source() / folder)) {
    const std::string ending = file.path().extension();
    if ((ending == ".cc" || ending == ".h") && file.path().filename() != "reasons.h") code += Content(file.path());
  }
  return code;
}

std::vector<ErrorReason> Reasons() {
  std::vector<ErrorReason> reasons;
  const google::protobuf::EnumDescriptor* all = errors::v1::ErrorReason_descriptor();
  for (int i = 0; i < all->value_count(); ++i)
    if (all->value(i)->number() != 0) reasons.push_back(static_cast<ErrorReason>(all->value(i)->number()));
  return reasons;
}

// Of the table of reasons: its cells behind the reason's own.
std::map<std::string, std::vector<std::string>> Catalogue() {
  std::map<std::string, std::vector<std::string>> rows;
  const std::string page = Content(Source() / "docs/errors.md");
  const std::regex row(R"(\n\| ([A-Z_]+) \| ([A-Z_]+) \| ([^|]+) \| ([^|]+) \| ([^|\n]*) ?\|)");
  const std::string table = page.substr(page.find("## Reasons"));
  for (std::sregex_iterator at(table.begin(), table.end(), row), end; at != end; ++at)
    rows[(*at)[1]] = {(*at)[2], (*at)[3], (*at)[4], (*at)[5]};
  return rows;
}

TEST(ErrorReasons, StandInTheCatalogueWithTheirCodes) {
  const auto catalogue = Catalogue();
  for (const ErrorReason reason : Reasons()) {
    const auto row = catalogue.find(errors::v1::ErrorReason_Name(reason));
    ASSERT_NE(row, catalogue.end()) << errors::v1::ErrorReason_Name(reason);
    EXPECT_EQ(row->second[0], absl::StatusCodeToString(CodeOf(reason))) << row->first;
  }
}

TEST(ErrorReasons, OfTheCatalogueAreAllInTheContract) {
  const auto catalogue = Catalogue();
  EXPECT_EQ(catalogue.size(), Reasons().size());
  for (const auto& [name, cells] : catalogue) {
    ErrorReason reason;
    EXPECT_TRUE(errors::v1::ErrorReason_Parse(name, &reason)) << name;
  }
}

TEST(ErrorReasons, AreEachGivenSomewhere) {
  const std::string services = CodeUnder("services") + CodeUnder("cli"), storage = CodeUnder("storage");
  const std::string of_storage = Content(Source() / "storage/reasons.h");
  for (const ErrorReason reason : Reasons()) {
    const std::string& name = errors::v1::ErrorReason_Name(reason);
    const bool by_services = services.find("errors::v1::" + name) != std::string::npos;
    std::smatch constant;
    const bool named = std::regex_search(of_storage, constant, std::regex("(\\w+)\\[\\] = \"" + name + "\""));
    EXPECT_TRUE(by_services || (named && storage.find(constant[1].str()) != std::string::npos)) << name;
  }
}

TEST(ErrorReasons, OfStorageAreInTheContract) {
  for (const char* name : storage::kReasons) {
    ErrorReason reason;
    EXPECT_TRUE(errors::v1::ErrorReason_Parse(name, &reason)) << name;
  }
  // And no text of its own beside the list.
  EXPECT_FALSE(std::regex_search(CodeUnder("storage"), std::regex("WithReason\\([^;]*, \"")));
}

TEST(ErrorReasons, AreCommentedInTheContract) {
  const std::string contract = Content(Source() / "proto/sixpoint/errors/v1/error_reason.proto");
  for (const ErrorReason reason : Reasons())
    EXPECT_TRUE(
        std::regex_search(contract, std::regex("\n  // [^\n]+\n  " + errors::v1::ErrorReason_Name(reason) + " = ")))
        << errors::v1::ErrorReason_Name(reason);
}

}  // namespace
}  // namespace sixpoint::runtime

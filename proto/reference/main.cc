// sixpoint-contract: tells what the contract says, for programs (OpenAPI) and for people (docs/api).
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <set>

#include "proto/reference/contract.h"

int main(int argc, char** argv) {
  using namespace sixpoint;
  const std::string what = argc == 5 ? argv[1] : "", out = argc == 5 ? argv[4] : "";
  if (what != "openapi" && what != "markdown") {
    std::cerr << "usage: sixpoint-contract openapi|markdown contract.binpb doors.json OUT\n";
    return 2;
  }
  google::protobuf::DescriptorPool pool;
  const auto files = reference::ReadContract(argv[2], &pool);
  std::ifstream doors(argv[3]);
  const std::string doors_json{std::istreambuf_iterator<char>(doors), {}};
  if (what == "openapi") return std::ofstream(out) << reference::OpenApi(files, doors_json) ? 0 : 1;
  std::filesystem::create_directories(out);
  std::set<std::string> packages;
  for (const auto* const file : files) packages.insert(file->package());
  for (const std::string& package : packages) {
    const std::string area = package.substr(9, package.find('.', 9) - 9);
    if (!(std::ofstream(out + "/" + area + ".md") << reference::Markdown(files, package))) return 1;
  }
  return 0;
}

#include "tests/metrology/cad/written_cad.h"

#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Message_Printer.hxx>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

namespace sixpoint::testing {

std::string Written(const std::function<void(const std::string& path)>& write) {
  Message::DefaultMessenger()->RemovePrinters(STANDARD_TYPE(Message_Printer));
  std::string folder = (std::filesystem::temp_directory_path() / "sample-cad-XXXXXX").string();
  if (mkdtemp(folder.data()) == nullptr) std::abort();
  const std::string path = folder + "/part";
  write(path);
  std::ifstream file(path, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(file), {}};
  std::filesystem::remove_all(folder);
  return bytes;
}

}  // namespace sixpoint::testing

#include "cli/download_command.h"

#include <memory>

#include "cli/out_file.h"
#include "cli/output.h"

namespace sixpoint::cli {

void AddDownloadCommand(Command* noun, Session* session, const Download& download, const std::string& what,
                        const std::string& collection,
                        absl::StatusOr<std::string> (*fetch)(Session*, const std::string& name,
                                                             const std::string& out)) {
  struct Arguments {
    std::string id, out;
  };
  const auto arguments = std::make_shared<Arguments>();
  Command* command = noun->AddCommand(download.name, download.help);
  command->AddOption("ID", &arguments->id, what)->Required();
  AddOutOption(command, &arguments->out, download.file)->Required();
  session->OnCommand(command, [session, arguments, collection, fetch]() -> absl::Status {
    if (absl::Status good = CheckOut(*session, arguments->out); !good.ok()) return good;
    const auto content = fetch(session, NameText(collection, arguments->id), arguments->out);
    return content.ok() ? WriteOut(arguments->out, *content) : content.status();
  });
}

}  // namespace sixpoint::cli

// `sixpoint open`: the link of a thing's page.
#include <iostream>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/output.h"
#include "services/runtime/errors.h"
#include "sixpoint/plant/v1/plant.grpc.pb.h"

namespace sixpoint::cli {
namespace {

// A name of the contract is the page's path; a serial number alone is a blade's.
std::string PathOf(const std::string& subject) {
  if (subject.empty()) return "/";
  return "/" + (subject.find('/') == std::string::npos ? NameText("blades", subject) : subject);
}

absl::Status Open(Session* session, const std::string& subject) {
  plant::v1::ListEndpointsResponse endpoints;
  const absl::Status listed = session->Call<plant::v1::PlantService>(
      "plant", &plant::v1::PlantService::Stub::ListEndpoints, plant::v1::ListEndpointsRequest(), &endpoints);
  if (!listed.ok()) return listed;
  if (endpoints.page_url().empty())
    return absl::FailedPreconditionError(
        "page: this plant has none, want one whose gateway runs (`sixpoint up --http direct`)");
  std::string url = endpoints.page_url();
  if (url.back() == '/') url.pop_back();
  const std::string link = url + PathOf(subject);
  if (session->json) {
    PrintJson({{"url", link}});
  } else {
    std::cout << link << "\n";
  }
  return absl::OkStatus();
}

}  // namespace

void AddOpenCommand(Command* app, Session* session) {
  Command* const open = app->AddCommand("open", "The link of a page: of the fleet, of a blade, or of what NAME is");
  const auto subject = std::make_shared<std::string>();
  open->AddOption("NAME", subject.get(),
                  "A blade's serial number, or a name such as machines/sarix-1; without it the fleet");
  session->OnCommand(open, [session, subject] { return Open(session, *subject); });
}

}  // namespace sixpoint::cli

// How quick 1000 seeded blades leave as files, beside reading their rows; the QIF documents are left in a folder, to be validated.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "seed/seed_plant.h"
#include "services/inspection/export_service.h"
#include "services/runtime/call.h"
#include "sixpoint/plant/v1/plant.grpc.pb.h"
#include "tests/support/in_process_server.h"
#include "tests/support/throwaway_database.h"

namespace {

using namespace sixpoint;

// Knows any machine.
class AnyMachine final : public plant::v1::PlantService::Service {
  grpc::Status GetMachine(grpc::ServerContext*, const plant::v1::GetMachineRequest* request,
                          plant::v1::Machine* response) override {
    response->set_name(request->name());
    response->mutable_sensor()->set_model("line scanner");
    response->mutable_sensor()->set_serial_number("4711");
    return grpc::Status::OK;
  }
};

double SecondsOf(const std::function<void()>& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

// All of them, as an export reads them.
std::size_t ReadRows(storage::Database* database) {
  const auto store = storage::InspectionsIn(database);
  std::size_t holes = 0;
  for (std::int64_t before = 0;;) {
    const auto rows = store->List({}, before, inspection::kExportPage, testing::Soon(300));
    if (!rows.ok()) return 0;
    for (const storage::InspectionRow& row : *rows) {
      holes += row.holes.size();
      before = row.recorded.sequence;
    }
    if (rows->size() < inspection::kExportPage) return holes;
  }
}

using Files = std::map<std::string, std::string>;
Files Export(inspection::v1::ExportService::Stub* stub, inspection::v1::ExportFormat format) {
  inspection::v1::ExportResultsRequest request;
  request.set_format(format);
  const auto context = runtime::ContextFor(300);
  const auto reader = stub->ExportResults(context.get(), request);
  Files files;
  for (inspection::v1::ExportResultsResponse piece; reader->Read(&piece);) files[piece.file()] += piece.content();
  const grpc::Status status = reader->Finish();
  if (!status.ok()) std::printf("%s\n", status.error_message().c_str());
  return status.ok() ? files : Files();
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Exports beside the rows that they are made of");
  int blade_count = 1000, rounds = 20;
  std::string folder;
  app.add_option("--blades", blade_count)->check(CLI::Range(1, 1000))->capture_default_str();
  app.add_option("--rounds", rounds)->check(CLI::Range(1, 100))->capture_default_str();
  app.add_option("--folder", folder, "Where the QIF documents go");
  CLI11_PARSE(app, argc, argv);
  testing::ThrowawayDatabase database;
  seed::Request request;
  request.options = {3, blade_count, 4, 2};
  const auto planted = seed::SeedPlant(database.conninfo(), request, [](int) {});
  if (!planted.ok()) {
    std::printf("%s\n", planted.status().ToString().c_str());
    return 1;
  }
  AnyMachine machines;
  testing::InProcessServer plant({&machines});
  inspection::ExportService service(
      storage::InspectionsIn(database.database()), storage::DeviationsIn(database.database()),
      storage::AssessmentsIn(database.database()),
      std::make_shared<const clients::BladePeers>(plant.Connect(), plant.Connect(), plant.Connect(), plant.Connect()));
  testing::InProcessServer server({&service});
  const auto stub = inspection::v1::ExportService::NewStub(server.Connect());
  const std::pair<const char*, inspection::v1::ExportFormat> formats[] = {
      {"qif", inspection::v1::EXPORT_FORMAT_QIF},
      {"aqdef", inspection::v1::EXPORT_FORMAT_AQDEF},
      {"csv", inspection::v1::EXPORT_FORMAT_CSV}};
  std::size_t holes = 0;
  double rows_s = 1e9;
  std::map<std::string, double> export_s;
  std::map<std::string, Files> exported;
  for (int round = 0; round < rounds; ++round) {  // in turn: a machine that slows down slows all
    rows_s = std::min(rows_s, SecondsOf([&] { holes = ReadRows(database.database()); }));
    for (const auto& [name, format] : formats) {
      const double s = SecondsOf([&, of = format, to = std::string(name)] { exported[to] = Export(stub.get(), of); });
      export_s[name] = export_s.count(name) > 0 ? std::min(export_s[name], s) : s;
    }
  }
  nlohmann::json figures = {{"export_holes", holes}, {"export_rows_s", rows_s}};
  double least = 1e9;
  for (const auto& [name, s] : export_s) {
    std::size_t bytes = 0;
    for (const auto& [file, content] : exported[name]) bytes += content.size();
    std::printf("%-6s %6zu files %10zu bytes %8.3f s; rows alone %.3f s: %.2f of their rate\n", name.c_str(),
                exported[name].size(), bytes, s, rows_s, rows_s / s);
    figures["export_" + name + "_over_rows_rate"] = rows_s / s;
    least = std::min(least, bytes > 0 ? rows_s / s : 0.0);
  }
  figures["export_over_rows_rate"] = least;
  for (const auto& [file, content] : exported["qif"])
    if (!folder.empty()) std::ofstream(folder + "/" + file, std::ios::binary) << content;
  std::printf("%s\n", figures.dump().c_str());
  return 0;
}

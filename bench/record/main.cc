// What `bench/run record` measures: the record of a blade and recall, by gRPC and in SQL as a person would write it by hand, on the same
// plant, by turns. The last line is one JSON object.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "bench/ground/transactions.h"
#include "bench/record/beside.h"
#include "bench/record/event_writers.h"
#include "bench/record/fleet.h"
#include "bench/record/tampering.h"
#include "bench/record/values.h"
#include "services/plant/record_service.h"
#include "tests/support/in_process_server.h"

namespace sixpoint::bench {
namespace {

using plant::v1::RecordService;

constexpr char kVerdictAndState[] =
    "CASE e.kind WHEN 'inspection' THEN (SELECT v.verdict FROM inspections v WHERE v.inspection_id = e.record_id) "
    "WHEN 'registration' THEN (SELECT g.outcome FROM registrations g WHERE g.registration_id = e.record_id) END, "
    "CASE e.kind WHEN 'calibration' THEN calibration_state(e.record_id, statement_timestamp()) WHEN 'correction' THEN "
    "correction_state(e.record_id) WHEN 'scan' THEN CASE WHEN EXISTS "
    "(SELECT 1 FROM scan_deletions d WHERE d.scan_key = e.record_id) THEN 'POINTS_DELETED' ELSE 'KEPT' END END "
    "FROM record_entries e JOIN record_names n ON n.record_id = e.record_id ";
const std::string kColumns =
    std::string(
        "SELECT e.record_sequence, e.recorded_at, e.kind, n.name, e.blade_serial, e.machine_id, e.method, "
        "e.software_version, "
        "e.requested_by, e.measured_at, e.summary::text, ARRAY(SELECT m.name FROM record_inputs i JOIN record_names m "
        "ON m.record_id = i.input_id WHERE i.record_id = e.record_id ORDER BY i.position_index), ") +
    kVerdictAndState;

class Measured {
 public:
  Measured(const std::string& conninfo, std::string name)
      : database_(storage::Database::Open(conninfo, 4)),
        service_(storage::PlantIn(database_.get()).journal, storage::PlantIn(database_.get()).blades),
        server_({&service_}),
        stub_(RecordService::NewStub(server_.Connect())),
        name_(std::move(name)) {}

  std::int64_t Sql(const std::string& sql, const storage::Params& params) {
    storage::Transaction transaction = Begin(database_.get());
    return Must(transaction.Execute(sql.c_str(), params)).count();
  }
  nlohmann::json Blade(const std::string& serial) {
    return Beside(
        [&] {
          plant::v1::GetBladeRecordRequest request;
          request.set_name("blades/" + serial);
          plant::v1::BladeRecord record;
          grpc::ClientContext context;
          Check(stub_->GetBladeRecord(&context, request, &record));
          return record.entries_size();
        },
        [&] {
          return Sql(kColumns + "WHERE e.blade_serial = $1 ORDER BY e.record_sequence", storage::Params().Text(serial));
        });
  }
  // Its first or a later page; the token of the next, empty where there is none.
  std::string Page(int size, const std::string& token, std::int64_t* rows) {
    plant::v1::RecallRequest request;
    request.set_name(name_);
    request.set_page_size(size);
    request.set_page_token(token);
    plant::v1::RecallResponse response;
    grpc::ClientContext context;
    Check(stub_->Recall(&context, request, &response));
    *rows += response.entries_size();
    return response.next_page_token();
  }
  nlohmann::json Recall() {
    return Beside(
        [&] {
          std::int64_t rows = 0;
          for (std::string token = Page(1000, "", &rows); !token.empty();) token = Page(1000, token, &rows);
          return rows;
        },
        [&] {
          return Sql(
              "WITH RECURSIVE derived (record_id) AS (SELECT i.record_id FROM record_inputs i JOIN record_names n "
              "ON n.record_id = i.input_id WHERE n.name = $1 UNION SELECT i.record_id FROM derived d "
              "JOIN record_inputs i ON i.input_id = d.record_id) " +
                  kColumns + "JOIN derived r ON r.record_id = e.record_id ORDER BY e.record_sequence",
              storage::Params().Text(name_));
        });
  }
  nlohmann::json Depth(int size, int page) {
    std::string token;
    std::int64_t rows = 0;
    for (int i = 1; i < page; ++i) token = Page(size, token, &rows);
    std::vector<double> first_s, deep_s, offset_s;
    for (int round = 0; round < 21; ++round) {
      first_s.push_back(Time([&] { return Page(size, "", &rows).size(); }).s);
      deep_s.push_back(Time([&] { return Page(size, token, &rows).size(); }).s);
    }
    for (int round = 0; round < 3; ++round)
      offset_s.push_back(
          Time([&] {
            return Sql(
                "WITH RECURSIVE derived (record_id) AS (SELECT i.record_id FROM record_inputs i "
                "JOIN record_names n ON n.record_id = i.input_id WHERE n.name = $1 UNION "
                "SELECT i.record_id FROM derived d JOIN record_inputs i ON i.input_id = d.record_id) " +
                    kColumns +
                    "JOIN derived r ON r.record_id = e.record_id ORDER BY e.record_sequence "
                    "LIMIT $2 OFFSET $3",
                storage::Params().Text(name_).Int(size).Int(static_cast<std::int64_t>(size) * (page - 1)));
          }).s);
    return {{"first_s", Median(first_s)},
            {"deep_s", Median(deep_s)},
            {"over", Median(deep_s) / Median(first_s)},
            {"offset_s", Median(offset_s)}};
  }

 private:
  static void Check(const grpc::Status& status) {
    if (status.ok()) return;
    std::fprintf(stderr, "%s\n", status.error_message().c_str());
    std::exit(2);
  }
  std::unique_ptr<storage::Database> database_;
  plant::RecordService service_;
  testing::InProcessServer server_;
  std::unique_ptr<RecordService::Stub> stub_;
  const std::string name_;
};

}  // namespace
}  // namespace sixpoint::bench

int main(int argc, char** argv) {
  using namespace sixpoint::bench;
  std::string conninfo, blade, machine;
  int page_size = 60;
  CLI::App app("The record asked", "sixpoint-bench-record");
  app.add_option("--database", conninfo)->required();
  app.require_subcommand(1);
  app.fallthrough();
  const auto print = [](const nlohmann::json& figures) { std::printf("%s\n", figures.dump().c_str()); };
  CLI::App* ask = app.add_subcommand("ask", "A blade's record and a machine's recall, beside SQL");
  ask->add_option("--blade", blade, "A serial number")->required();
  ask->add_option("--machine", machine, "An id")->required();
  ask->add_option("--page-size", page_size, "Such that there are a thousand pages");
  ask->callback([&] {
    Measured measured(conninfo, "machines/" + machine + "@1");
    print(
        {{"blade", measured.Blade(blade)}, {"recall", measured.Recall()}, {"depth", measured.Depth(page_size, 1000)}});
  });
  CLI::App* write = app.add_subcommand("write", "Entries without end, for who listens");
  int writer_count = 4, pause_ms = 30;
  write->add_option("--writers", writer_count)->check(CLI::Range(1, 32));
  write->add_option("--pause-ms", pause_ms)->check(CLI::Range(0, 10000));
  write->callback([&] { WriteEvents(conninfo, writer_count, pause_ms); });
  CLI::App* values = app.add_subcommand("values", "One characteristic of all blades of a machine");
  values->add_option("--machine", machine, "An id")->required();
  values->callback([&] { print(AskValues(conninfo, machine)); });
  CLI::App* search = app.add_subcommand("search", "Values by each filter, a page at a time");
  search->add_option("--machine", machine, "An id")->required();
  search->callback([&] { print(AskSearch(conninfo, machine)); });
  CLI::App* fleet = app.add_subcommand("fleet", "How all machines stand");
  fleet->callback([&] { print(AskFleet(conninfo)); });
  app.add_subcommand("tamper", "Every kind of tampering, on copies of a small plant")->callback([&] {
    print(TamperWithAll(conninfo));
  });
  app.add_subcommand("verify", "What sealing and a check cost, beside SQL")->callback([&] {
    print(SealAndVerify(conninfo));
  });
  CLI11_PARSE(app, argc, argv);
  return 0;
}

// What `bench/run record` measures: the record of a blade and recall, by gRPC and in SQL as a person would write it by hand, on the same
// plant, by turns. The last line is one JSON object.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <thread>

#include "bench/ground/blade_rows.h"
#include "bench/ground/transactions.h"
#include "bench/record/event_writers.h"
#include "services/plant/record_service.h"
#include "tests/support/in_process_server.h"

namespace sixpoint::bench {
namespace {

using plant::v1::RecordService;

constexpr int kRounds = 7;

struct Took {
  double s = 0;
  std::int64_t rows = 0;
};
template <typename Work>
Took Time(const Work& work) {
  const auto began = std::chrono::steady_clock::now();
  const std::int64_t rows = work();
  return {std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count(), rows};
}

double Median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

// Both by turns, the median of each; ends where they do not give as many rows.
template <typename Ours, typename Sql>
nlohmann::json Beside(const Ours& ours, const Sql& sql) {
  std::vector<double> ours_s, sql_s;
  std::int64_t rows = 0;
  for (int round = 0; round < kRounds; ++round) {
    const Took first = Time(ours), second = Time(sql);
    if (first.rows != second.rows) {
      std::fprintf(stderr, "ours gives %ld rows, SQL %ld\n", static_cast<long>(first.rows),
                   static_cast<long>(second.rows));
      std::exit(2);
    }
    rows = first.rows;
    ours_s.push_back(first.s);
    sql_s.push_back(second.s);
  }
  return {
      {"rows", rows}, {"ours_s", Median(ours_s)}, {"sql_s", Median(sql_s)}, {"over", Median(ours_s) / Median(sql_s)}};
}

constexpr char kVerdictAndState[] =
    "CASE e.kind WHEN 'inspection' THEN (SELECT v.verdict FROM inspections v WHERE v.inspection_id = e.record_id) "
    "WHEN 'registration' THEN (SELECT g.outcome FROM registrations g WHERE g.registration_id = e.record_id) END, "
    "CASE e.kind WHEN 'correction' THEN correction_state(e.record_id) WHEN 'scan' THEN CASE WHEN EXISTS "
    "(SELECT 1 FROM scan_deletions d WHERE d.scan_key = e.record_id) THEN 'POINTS_DELETED' ELSE 'KEPT' END END "
    "FROM record_entries e JOIN record_names n ON n.record_id = e.record_id ";
const std::string kColumns =
    std::string(
        "SELECT e.record_sequence, e.recorded_at, e.kind, n.name, e.blade_serial, e.machine_id, e.method, "
        "e.software_version, "
        "e.requested_by, e.measured_at, e.summary::text, ARRAY(SELECT m.name FROM record_inputs i JOIN record_names m "
        "ON m.record_id = i.input_id WHERE i.record_id = e.record_id ORDER BY i.position_index), ") +
    kVerdictAndState;

void Fill(const std::string& conninfo, int blade_count) {
  const auto database = storage::Database::Open(conninfo + " options='-c synchronous_commit=off'", 4);
  const Registry registry = MakeRegistry(database.get());
  std::vector<std::thread> threads;
  for (int t = 0; t < 2; ++t)
    threads.emplace_back([&, t] {
      for (int i = t; i < blade_count; i += 2) AddBlade(database.get(), registry, "SN-" + std::to_string(i), {1, 1, 2});
    });
  for (std::thread& thread : threads) thread.join();
  std::printf("%s\n", nlohmann::json{{"calibration", registry.sensor_calibration_id}}.dump().c_str());
}

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
  nlohmann::json Blade() {
    return Beside(
        [&] {
          plant::v1::GetBladeRecordRequest request;
          request.set_name("blades/SN-77");
          plant::v1::BladeRecord record;
          grpc::ClientContext context;
          Check(stub_->GetBladeRecord(&context, request, &record));
          return record.entries_size();
        },
        [&] {
          return Sql(kColumns + "WHERE e.blade_serial = $1 ORDER BY e.record_sequence",
                     storage::Params().Text("SN-77"));
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
  std::string conninfo, calibration;
  int blade_count = 10000;
  CLI::App app("The record asked", "sixpoint-bench-record");
  app.add_option("--database", conninfo)->required();
  app.require_subcommand(1);
  app.fallthrough();
  CLI::App* fill = app.add_subcommand("fill", "Blades with their results");
  fill->add_option("--blades", blade_count)->check(CLI::Range(100, 1'000'000));
  fill->callback([&] { Fill(conninfo, blade_count); });
  CLI::App* ask = app.add_subcommand("ask", "Questions, beside SQL");
  ask->add_option("--calibration", calibration)->required();
  ask->add_option("--blades", blade_count);
  ask->callback([&] {
    Measured measured(conninfo, "calibrations/" + calibration);
    nlohmann::json figures = {{"blade", measured.Blade()}, {"recall", measured.Recall()}};
    // Four entries of a blade rest on the calibration.
    figures["depth"] = measured.Depth(std::max(1, 4 * blade_count / 1001), 1000);
    std::printf("%s\n", figures.dump().c_str());
  });
  CLI::App* write = app.add_subcommand("write", "Entries without end, for who listens");
  int writer_count = 4, pause_ms = 30;
  write->add_option("--writers", writer_count)->check(CLI::Range(1, 32));
  write->add_option("--pause-ms", pause_ms)->check(CLI::Range(0, 10000));
  write->callback([&] { WriteEvents(conninfo, writer_count, pause_ms); });
  CLI11_PARSE(app, argc, argv);
  return 0;
}

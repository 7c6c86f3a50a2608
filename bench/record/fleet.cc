#include "bench/record/fleet.h"

#include <cstdio>
#include <cstdlib>

#include "bench/ground/transactions.h"
#include "bench/record/beside.h"
#include "services/plant/fleet_service.h"
#include "storage/plant_store.h"
#include "tests/support/in_process_server.h"

namespace sixpoint::bench {
namespace {

// What the answer is made of, as a person would ask it by hand; the machines' rows are counted.
constexpr const char* kFleetSql[] = {
    "SELECT machine_id FROM machines ORDER BY machine_id LIMIT 1001",
    "SELECT machine_id, measure, bucket, sum(entry_count), sum(seconds) FROM machine_activity WHERE period = 'hour' "
    "AND begins_at >= date_trunc('hour', now() - interval '24 hours') GROUP BY 1, 2, 3",
    "SELECT c.machine_id, c.kind, n.name, c.recorded_at, c.run_count FROM machine_contacts c JOIN record_names n "
    "USING (record_id) ORDER BY 1, c.record_sequence DESC",
    "SELECT * FROM machine_calibrations ORDER BY machine_id, kind, axis",
    "SELECT * FROM machine_work",
    "SELECT * FROM machine_damages",
    "SELECT scan_id, header, next_block, point_count, stored_bytes, started_at, touched_at FROM scan_uploads"};

}  // namespace

nlohmann::json AskFleet(const std::string& conninfo) {
  const auto database = storage::Database::Open(conninfo, 4);
  plant::FleetService service(storage::FleetIn(database.get()), storage::PlantIn(database.get()).clearances);
  testing::InProcessServer server({&service});
  const auto stub = plant::v1::FleetService::NewStub(server.Connect());
  return Beside(
      [&] {
        plant::v1::ListMachineStatesRequest request;
        request.set_page_size(1000);
        plant::v1::ListMachineStatesResponse response;
        grpc::ClientContext context;
        const grpc::Status status = stub->ListMachineStates(&context, request, &response);
        if (!status.ok()) {
          std::fprintf(stderr, "%s\n", status.error_message().c_str());
          std::exit(2);
        }
        return response.machines_size();
      },
      [&] {
        std::int64_t machine_count = -1;
        for (const char* const sql : kFleetSql) {
          storage::Transaction transaction = Begin(database.get());
          const std::int64_t rows = Must(transaction.Execute(sql)).count();
          if (machine_count < 0) machine_count = rows;
        }
        return machine_count;
      });
}

}  // namespace sixpoint::bench

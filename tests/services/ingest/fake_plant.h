// A plant that knows machines/m1, artefacts/a1, blades/sn1 and blades/sn2, and counts what it is asked.
#pragma once

#include <atomic>

#include "sixpoint/plant/v1/plant.grpc.pb.h"
#include "tests/services/ingest/sample_scans.h"

namespace sixpoint::ingest {

class FakePlant final : public plant::v1::PlantService::Service {
 public:
  grpc::Status GetMachine(grpc::ServerContext*, const plant::v1::GetMachineRequest* request,
                          plant::v1::Machine* response) override {
    ++asked_count;
    if (away) return grpc::Status(grpc::StatusCode::UNAVAILABLE, "away");
    if (request->name() != "machines/m1" && request->name() != "machines/m1@3") return NotFound(request->name());
    *response = gives_snapshots ? SampleSnapshotMachine() : SampleMachine();
    return grpc::Status::OK;
  }
  grpc::Status GetArtefact(grpc::ServerContext*, const plant::v1::GetArtefactRequest* request,
                           plant::v1::Artefact* response) override {
    if (request->name() != "artefacts/a1") return NotFound(request->name());
    response->set_name(request->name());
    response->set_revision(2);
    return grpc::Status::OK;
  }
  grpc::Status GetBlade(grpc::ServerContext*, const plant::v1::GetBladeRequest* request,
                        plant::v1::Blade* response) override {
    if (request->name() != "blades/sn1" && request->name() != "blades/sn2") return NotFound(request->name());
    response->set_name(request->name());
    response->set_part("parts/p1");
    return grpc::Status::OK;
  }
  grpc::Status GetPart(grpc::ServerContext*, const plant::v1::GetPartRequest* request,
                       plant::v1::Part* response) override {
    if (request->name() != "parts/p1") return NotFound(request->name());
    response->set_name(request->name());
    for (const double tolerance_mm : {0.05, 0.06, 0.04}) {
      plant::v1::HoleGroup& group = *response->add_hole_groups();
      group.set_position_tolerance_mm(tolerance_mm);
      group.set_position_zone(tolerance_mm == 0.06 ? plant::v1::POSITION_ZONE_DIAMETER
                                                   : plant::v1::POSITION_ZONE_RADIUS);
    }
    for (const std::string& station : stations) response->add_stations()->set_station(station);
    return grpc::Status::OK;
  }

  std::atomic<int> asked_count = 0;
  std::atomic<bool> away = false, gives_snapshots = false;
  std::vector<std::string> stations;  // of the part; set before the first call

 private:
  static grpc::Status NotFound(const std::string& name) {
    return grpc::Status(grpc::StatusCode::NOT_FOUND, name + " is not known");
  }
};

}  // namespace sixpoint::ingest

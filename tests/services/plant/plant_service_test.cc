// The service over real gRPC on a real PostgreSQL, with the real CAD worker.
#include "services/plant/plant_service.h"

#include <gmock/gmock.h>
#include <google/protobuf/util/message_differencer.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <sstream>
#include <thread>

#include "services/clients/parts.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "storage/blobs.h"
#include "storage/plant_registry.h"
#include "tests/metrology/cad/foreign_cad.h"
#include "tests/metrology/cad/sample_cad.h"
#include "tests/services/plant/sample_registry.h"
#include "tests/support/in_process_server.h"
#include "tests/support/some_uuid.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::plant {
namespace {

using google::protobuf::util::MessageDifferencer;
using sixpoint::testing::kSomeUuid;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::SampleShape;

const std::string& CylinderCad() {
  static const std::string cad = testing::StepOf(SampleShape::kCylinder);
  return cad;
}

class PlantServiceTest : public ::testing::Test {
 protected:
  PlantServiceTest()
      : service_(OptionsForTest(), storage::PlantIn(database_.database())),
        server_({&service_}),
        channel_(server_.Connect()),
        stub_(v1::PlantService::NewStub(channel_)) {}

  static PlantServiceOptions OptionsForTest() {
    const char* folder = std::getenv("SIXPOINT_BIN_DIR");
    PlantServiceOptions options;
    options.cad_worker.program = std::string(folder == nullptr ? "." : folder) + "/sixpoint-cad-worker";
    options.endpoints = {{"plant", "127.0.0.1:7400"}, {"ingest", "127.0.0.1:7401"}};
    return options;
  }

  template <typename Request, typename Response>
  absl::StatusOr<Response> Call(grpc::Status (v1::PlantService::Stub::*method)(grpc::ClientContext*, const Request&,
                                                                               Response*),
                                const Request& request) {
    Response response;
    const auto context = runtime::ContextFor(60.0);
    const absl::Status status = runtime::FromGrpc(((*stub_).*method)(context.get(), request, &response));
    if (!status.ok()) return status;
    return response;
  }
  absl::StatusOr<v1::Machine> Create(const v1::CreateMachineRequest& request) {
    return Call(&v1::PlantService::Stub::CreateMachine, request);
  }
  absl::StatusOr<v1::Artefact> Create(const v1::CreateArtefactRequest& request) {
    return Call(&v1::PlantService::Stub::CreateArtefact, request);
  }
  absl::StatusOr<v1::Part> Create(const v1::CreatePartRequest& request) {
    return Call(&v1::PlantService::Stub::CreatePart, request);
  }
  absl::StatusOr<v1::Blade> CreateBlade(const std::string& serial, const std::string& part) {
    v1::CreateBladeRequest request;
    request.set_serial(serial);
    request.set_part(part);
    return Call(&v1::PlantService::Stub::CreateBlade, request);
  }
  absl::StatusOr<v1::Machine> GetMachine(const std::string& name) {
    v1::GetMachineRequest request;
    request.set_name(name);
    return Call(&v1::PlantService::Stub::GetMachine, request);
  }
  absl::StatusOr<v1::Part> GetPart(const std::string& name) {
    v1::GetPartRequest request;
    request.set_name(name);
    return Call(&v1::PlantService::Stub::GetPart, request);
  }

  std::int64_t Count(const std::string& table) {
    auto transaction = database_.database()->Begin(testing::Soon());
    if (!transaction.ok()) return -1;
    const auto rows = transaction->Execute("SELECT count(*) FROM " + table);
    return rows.ok() ? rows->Int(0, 0) : -1;
  }

  testing::ThrowawayDatabase database_;
  PlantService service_;
  testing::InProcessServer server_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::PlantService::Stub> stub_;
};

TEST_F(PlantServiceTest, AMachineComesBackBitForBit) {
  const v1::CreateMachineRequest request = SampleMachine();
  const auto created = Create(request);
  ASSERT_TRUE(created.ok()) << created.status();
  EXPECT_EQ(created->name(), "machines/m1");
  EXPECT_EQ(created->revision(), 1);
  const auto read = GetMachine("machines/m1");
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_TRUE(MessageDifferencer::Equals(*created, *read));
  v1::Machine described = *read;
  described.clear_name();
  described.clear_revision();
  described.clear_created_at();
  EXPECT_TRUE(MessageDifferencer::Equals(described, request.machine())) << described.DebugString();
}

// As the contract says; 0 is 0, and lets nothing pass.
TEST_F(PlantServiceTest, AnEnvelopeThatIsNotStatedIsTheContracts) {
  v1::CreateMachineRequest request = SampleMachine();
  request.mutable_machine()->clear_safety_envelope();
  const auto usual = Create(request);
  ASSERT_TRUE(usual.ok()) << usual.status();
  EXPECT_EQ(usual->safety_envelope().translation_mm(), 2);
  EXPECT_EQ(usual->safety_envelope().rotation_deg(), 3);
  EXPECT_EQ(usual->safety_envelope().uncertainty_share(), 1.0 / 3);
  EXPECT_EQ(usual->safety_envelope().registration_age_h(), 8);
  EXPECT_EQ(usual->safety_envelope().keep_out_mm(), 0.5);
  request.mutable_machine()->mutable_safety_envelope()->set_translation_mm(0);
  const auto never = Create(request);
  ASSERT_TRUE(never.ok()) << never.status();
  EXPECT_EQ(never->safety_envelope().translation_mm(), 0);
  EXPECT_EQ(never->safety_envelope().rotation_deg(), 3);
}

TEST_F(PlantServiceTest, AnotherDescriptionIsANewRevisionAndTheSameIsNot) {
  v1::CreateMachineRequest request = SampleMachine();
  ASSERT_TRUE(Create(request).ok());
  EXPECT_EQ(Create(request)->revision(), 1);
  request.mutable_machine()->mutable_sensor()->set_noise_um(3);
  EXPECT_EQ(Create(request)->revision(), 2);
  EXPECT_EQ(Create(request)->revision(), 2);
  EXPECT_EQ(GetMachine("machines/m1@1")->sensor().noise_um(), 2);  // what a result pinned stays
  EXPECT_EQ(GetMachine("machines/m1")->sensor().noise_um(), 3);
  EXPECT_EQ(Create(SampleMachine())->revision(), 3);  // back to the first description: the newest is another
  EXPECT_EQ(Count("record_entries WHERE kind = 'machine'"), 3);
}

TEST_F(PlantServiceTest, ARequestIdDoesTheWorkOnce) {
  v1::CreateMachineRequest request = SampleMachine();
  request.set_request_id(kSomeUuid);
  const auto first = Create(request);
  ASSERT_TRUE(first.ok()) << first.status();
  v1::CreateMachineRequest other = SampleMachine();
  other.mutable_machine()->mutable_sensor()->set_noise_um(3);
  ASSERT_EQ(Create(other)->revision(), 2);
  EXPECT_TRUE(MessageDifferencer::Equals(*Create(request), *first));  // the kept answer, not the newest
  other.set_request_id(kSomeUuid);
  EXPECT_EQ(Create(other).status().code(), absl::StatusCode::kAlreadyExists);
}

TEST_F(PlantServiceTest, AnArtefactComesBackBitForBit) {
  const v1::CreateArtefactRequest request = SampleArtefact();
  ASSERT_TRUE(Create(request).ok());
  v1::GetArtefactRequest get;
  get.set_name("artefacts/plate");
  auto read = Call(&v1::PlantService::Stub::GetArtefact, get);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->revision(), 1);
  read->clear_name();
  read->clear_revision();
  read->clear_created_at();
  EXPECT_TRUE(MessageDifferencer::Equals(*read, request.artefact())) << read->DebugString();
}

TEST_F(PlantServiceTest, APartComesBackWithItsSurface) {
  const v1::CreatePartRequest request = SamplePart(CylinderCad());
  const auto created = Create(request);
  ASSERT_TRUE(created.ok()) << created.status();
  EXPECT_EQ(created->surface().cad_sha256(), storage::Sha256Hex(CylinderCad()));
  EXPECT_TRUE(created->surface().closed());
  EXPECT_TRUE(created->surface().has_open_rim_count());
  EXPECT_EQ(created->surface().open_rim_count(), 0);
  EXPECT_EQ(created->surface().open_rim_length_mm(), 0);
  EXPECT_EQ(created->surface().degenerate_triangle_count(), 0);
  EXPECT_GT(created->surface().triangle_count(), 0);
  EXPECT_GT(created->surface().chordal_error_um(), 0);
  EXPECT_LE(created->surface().chordal_error_um(), 1);
  EXPECT_NEAR(created->surface().minimum_mm().x_mm(), -5, 1e-3);
  EXPECT_NEAR(created->surface().maximum_mm().z_mm(), 20, 1e-3);
  auto read = GetPart("parts/vane");
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_TRUE(MessageDifferencer::Equals(*created, *read));
  read->clear_name();
  read->clear_revision();
  read->clear_created_at();
  read->clear_surface();
  EXPECT_TRUE(MessageDifferencer::Equals(*read, request.part())) << read->DebugString();
}

// A box without its lid, and with a triangle in a line along an edge of its floor.
// The same stations are the same revision, others another; two at which one part may stand are refused.
TEST_F(PlantServiceTest, StationsComeBackBitForBit) {
  v1::CreatePartRequest request = SamplePart(CylinderCad());
  for (const double along_mm : {0.0, 1.0 / 3 + 20}) {
    v1::Station& station = *request.mutable_part()->add_stations();
    station.set_station("s" + std::to_string(request.part().stations_size()));
    *station.mutable_zero_from_part_nominal() = request.part().zero_from_part_nominal();
    station.mutable_zero_from_part_nominal()->mutable_translation_mm()->set_z_mm(along_mm);
    if (along_mm == 0) station.set_capture_mm(0.3);
  }
  const auto created = Create(request);
  ASSERT_TRUE(created.ok()) << created.status();
  v1::Part expected = request.part();
  expected.mutable_stations(1)->set_capture_mm(5);  // the contract's
  const auto read = GetPart("parts/vane");
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_EQ(read->stations_size(), 2);
  for (int i = 0; i < 2; ++i)
    EXPECT_TRUE(MessageDifferencer::Equals(read->stations(i), expected.stations(i))) << read->stations(i).DebugString();
  EXPECT_EQ(Create(request)->revision(), 1);
  request.mutable_part()->mutable_stations(0)->set_capture_mm(0.4);
  EXPECT_EQ(Create(request)->revision(), 2);
  EXPECT_EQ(GetPart("parts/vane@1")->stations(0).capture_mm(), 0.3);
  request.mutable_part()->mutable_stations(0)->set_capture_mm(16);
  EXPECT_THAT(std::string(Create(request).status().message()),
              HasSubstr("part.stations[1].zero_from_part_nominal: at most 20.33"));
  request.mutable_part()->clear_stations();
  EXPECT_EQ(Create(request)->revision(), 3);
}

// The same regions are the same revision, others another.
TEST_F(PlantServiceTest, ShapeRegionsComeBackBitForBit) {
  v1::CreatePartRequest request = SamplePart(CylinderCad());
  v1::ShapeRegion& edge = *request.mutable_part()->add_shape_regions();
  edge.set_region("leading edge");
  edge.set_kind(v1::SHAPE_REGION_KIND_MACHINED);
  edge.mutable_maximum_in_part_mm()->set_x_mm(1.0 / 3);
  edge.mutable_facing_in_part()->set_x(-1);
  edge.set_facing_within_deg(70);
  edge.set_allowance_mm(0.02);
  edge.set_lower_mm(-0.1);
  edge.set_upper_mm(0.3);
  v1::ShapeRegion& body = *request.mutable_part()->add_shape_regions();
  body.set_region("body");
  body.set_rest(true);
  body.set_kind(v1::SHAPE_REGION_KIND_FIXED);
  body.set_lower_mm(-0.6);
  body.set_upper_mm(0.6);
  const auto created = Create(request);
  ASSERT_TRUE(created.ok()) << created.status();
  const auto read = GetPart("parts/vane");
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_EQ(read->shape_regions_size(), 2);
  for (int i = 0; i < 2; ++i)
    EXPECT_TRUE(MessageDifferencer::Equals(read->shape_regions(i), request.part().shape_regions(i)))
        << read->shape_regions(i).DebugString();
  EXPECT_EQ(Create(request)->revision(), 1);
  request.mutable_part()->mutable_shape_regions(0)->set_allowance_mm(0.03);
  EXPECT_EQ(Create(request)->revision(), 2);
  EXPECT_EQ(GetPart("parts/vane@1")->shape_regions(0).allowance_mm(), 0.02);
}

TEST_F(PlantServiceTest, HolesOfTheCadAreCounted) {
  const double corners[8][3] = {{0, 0, 0}, {4, 0, 0}, {4, 3, 0}, {0, 3, 0}, {0, 0, 2}, {4, 0, 2}, {4, 3, 2}, {0, 3, 2}};
  const int triangles[10][3] = {{0, 2, 1}, {0, 3, 2}, {0, 1, 5}, {0, 5, 4}, {1, 2, 6},
                                {1, 6, 5}, {2, 3, 7}, {2, 7, 6}, {3, 0, 4}, {3, 4, 7}};
  std::ostringstream stl;
  stl << "solid box\n";
  const auto facet = [&](const double* a, const double* b, const double* c) {
    stl << "facet normal 0 0 0 outer loop";
    for (const double* v : {a, b, c}) stl << " vertex " << v[0] << ' ' << v[1] << ' ' << v[2];
    stl << " endloop endfacet\n";
  };
  for (const auto& t : triangles) facet(corners[t[0]], corners[t[1]], corners[t[2]]);
  const double middle[3] = {2, 0, 0};
  facet(corners[0], corners[1], middle);
  stl << "endsolid\n";
  v1::CreatePartRequest request = SamplePart(stl.str());
  request.mutable_part()->set_cad_format(v1::CAD_FORMAT_STL);
  request.mutable_part()->set_cad_unit_mm(1);
  request.mutable_part()->clear_hole_groups();
  request.mutable_part()->clear_six_points();
  const auto created = Create(request);
  ASSERT_TRUE(created.ok()) << created.status();
  EXPECT_FALSE(created->surface().closed());
  EXPECT_EQ(created->surface().open_rim_count(), 1);
  EXPECT_NEAR(created->surface().open_rim_length_mm(), 14, 1e-9);
  EXPECT_EQ(created->surface().degenerate_triangle_count(), 1);
  const auto read = GetPart("parts/vane");
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_TRUE(MessageDifferencer::Equals(*created, *read));
  // From before they were counted: not told, and no zeros either.
  auto transaction = database_.database()->Begin(testing::Soon());
  ASSERT_TRUE(transaction.ok());
  storage::TessellationRow before{created->surface().cad_sha256(),
                                  "of old",
                                  created->surface().surface_sha256(),
                                  11,
                                  0,
                                  false,
                                  {0, 0, 0},
                                  {4, 3, 2}};
  ASSERT_TRUE(storage::InsertTessellation(*transaction, before, "test").ok());
  const auto found = storage::FindTessellation(*transaction, before.cad_sha256, before.method);
  ASSERT_TRUE(found.ok() && found->has_value()) << found.status();
  EXPECT_FALSE((*found)->gaps.has_value());
}

TEST_F(PlantServiceTest, TheSameCadIsReadOnce) {
  v1::CreatePartRequest request = SamplePart(CylinderCad());
  ASSERT_TRUE(Create(request).ok());
  EXPECT_EQ(Create(request)->revision(), 1);
  request.mutable_part()->mutable_hole_groups(0)->set_depth_mm(7);
  EXPECT_EQ(Create(request)->revision(), 2);
  request.set_part_id("other");
  EXPECT_EQ(Create(request)->revision(), 1);
  EXPECT_EQ(service_.surfaces().read_count(), 1);
}

TEST_F(PlantServiceTest, TheClientFetchesASurfaceOnceForAllItsCalls) {
  const auto part = Create(SamplePart(CylinderCad()));
  ASSERT_TRUE(part.ok()) << part.status();
  const clients::PlantClient client(channel_);
  std::shared_ptr<const metrology::Surface> surfaces[4];
  std::vector<std::thread> threads;
  for (auto& surface : surfaces) {
    threads.emplace_back([&] {
      const auto fetched = client.GetSurface(*part, runtime::ContextFor(60.0));
      if (fetched.ok()) surface = *fetched;
    });
  }
  for (std::thread& thread : threads) thread.join();
  ASSERT_NE(surfaces[0], nullptr);
  for (const auto& surface : surfaces) EXPECT_EQ(surface, surfaces[0]);
  EXPECT_NEAR(surfaces[0]->Closest({7, 0, 10}).signed_distance_mm, 2, 1e-3);
}

TEST_F(PlantServiceTest, BadCadStoresNothing) {
  v1::CreatePartRequest request = SamplePart("no CAD at all");
  const auto unreadable = Create(request);
  EXPECT_EQ(unreadable.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(unreadable.status().message()), HasSubstr("cad.content: unreadable"));
  request.set_cad(CylinderCad());
  request.mutable_part()->set_cad_format(v1::CAD_FORMAT_STL);
  EXPECT_EQ(Create(request).status().code(), absl::StatusCode::kInvalidArgument);
  // Three triangles on one edge: no body has such a boundary.
  std::string fins = "solid fins\n";
  for (const char* tip : {"0 1 0", "0 0 1", "0 -1 0"})
    fins +=
        std::string("facet normal 0 0 0 outer loop vertex 0 0 0 vertex 1 0 0 vertex ") + tip + " endloop endfacet\n";
  request.set_cad(fins + "endsolid\n");
  request.mutable_part()->set_cad_unit_mm(1);
  EXPECT_THAT(std::string(Create(request).status().message()),
              HasSubstr("mesh.edges: 1 with more than two triangles, the first at (0.5, 0, 0) mm"));
  EXPECT_EQ(Count("parts"), 0);
  EXPECT_EQ(Count("tessellations"), 0);
  EXPECT_EQ(Count("record_entries"), 0);
}

// A cylinder of radius 5 mm in two halves that go on smoothly but for a step.
TEST_F(PlantServiceTest, GapsOfTheCadComeBackWithItsSurface) {
  v1::CreatePartRequest request = SamplePart(testing::StepOfSteppedHalves(0.033));
  request.mutable_part()->clear_hole_groups();
  request.mutable_part()->clear_six_points();
  const auto created = Create(request);
  ASSERT_TRUE(created.ok()) << created.status();
  EXPECT_NEAR(created->surface().healed_um(), 33, 0.01);
  EXPECT_NEAR(created->surface().gap_um(), 16.5, 0.01);
  EXPECT_NEAR(std::abs(created->surface().gap_at_mm().x_mm()), 5.0165, 1e-4);
  EXPECT_NEAR(created->surface().gap_at_mm().y_mm(), 0, 1e-4);
  const auto read = GetPart("parts/vane");
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_TRUE(MessageDifferencer::Equals(*created, *read));
  // None: told as none.
  request.set_cad(CylinderCad());
  const auto whole = Create(request);
  ASSERT_TRUE(whole.ok()) << whole.status();
  EXPECT_TRUE(whole->surface().has_gap_um() && whole->surface().has_healed_um());
  EXPECT_EQ(whole->surface().gap_um(), 0);
  EXPECT_FALSE(whole->surface().has_gap_at_mm());
}

TEST_F(PlantServiceTest, AGapBeyondATenthOfAMillimetreStoresNothing) {
  const auto refused = Create(SamplePart(testing::StepOfSteppedHalves(0.12)));
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(refused.status().message()), HasSubstr("cad.faces: an edge 0.12 mm off its face at ("));
  EXPECT_EQ(Count("parts"), 0);
  EXPECT_EQ(Count("tessellations"), 0);
}

TEST_F(PlantServiceTest, OneSolidOfAnAssemblyIsThePart) {
  v1::CreatePartRequest request = SamplePart(testing::StepOfAssembly({{"fixture", 8}, {"blade", 5}, {"clamp", 2}}));
  request.mutable_part()->clear_hole_groups();
  request.mutable_part()->clear_six_points();
  const auto none = Create(request);
  EXPECT_EQ(none.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(none.status().message()),
              HasSubstr("part.solid: none of 3 solids, want its name or number of 1 \"fixture\" (3072 mm3), 2 "));
  EXPECT_EQ(Count("parts"), 0);
  EXPECT_EQ(Count("tessellations"), 0);
  request.mutable_part()->set_solid("clamp");
  const auto clamp = Create(request);
  ASSERT_TRUE(clamp.ok()) << clamp.status();
  EXPECT_EQ(clamp->solid(), "clamp");
  EXPECT_NEAR(clamp->surface().maximum_mm().x_mm() - clamp->surface().minimum_mm().x_mm(), 2, 1e-9);
  const auto read = GetPart("parts/vane");
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_TRUE(MessageDifferencer::Equals(*clamp, *read));
  // Another solid of the same file is another surface and another revision.
  request.mutable_part()->set_solid("2");
  const auto blade = Create(request);
  ASSERT_TRUE(blade.ok()) << blade.status();
  EXPECT_EQ(blade->revision(), 2);
  EXPECT_NEAR(blade->surface().maximum_mm().x_mm() - blade->surface().minimum_mm().x_mm(), 5, 1e-9);
  EXPECT_NE(blade->surface().surface_sha256(), clamp->surface().surface_sha256());
  EXPECT_EQ(Count("tessellations"), 2);
}

TEST_F(PlantServiceTest, HolesOffTheCadAreRefused) {
  v1::CreatePartRequest request = SamplePart(CylinderCad());
  request.mutable_part()->mutable_hole_groups(0)->mutable_holes(2)->mutable_start_in_part_mm()->set_z_mm(508);
  EXPECT_THAT(std::string(Create(request).status().message()),
              HasSubstr("part.hole_groups[0].holes[2].start_in_part_mm: (3, 4, 508), want within"));
  EXPECT_EQ(Count("parts"), 0);
}

TEST_F(PlantServiceTest, ABladeIsOfOnePart) {
  EXPECT_EQ(CreateBlade("sn1", "parts/vane").status().code(), absl::StatusCode::kNotFound);
  ASSERT_TRUE(Create(SamplePart(CylinderCad())).ok());
  const auto blade = CreateBlade("sn1", "parts/vane");
  ASSERT_TRUE(blade.ok()) << blade.status();
  EXPECT_TRUE(MessageDifferencer::Equals(*CreateBlade("sn1", "parts/vane"), *blade));
  v1::CreatePartRequest other = SamplePart(CylinderCad());
  other.set_part_id("other");
  ASSERT_TRUE(Create(other).ok());
  EXPECT_EQ(CreateBlade("sn1", "parts/other").status().code(), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(Count("blades"), 1);
}

TEST_F(PlantServiceTest, PagesGoThroughAllMachinesOnce) {
  v1::CreateMachineRequest request = SampleMachine();
  for (const char* id : {"m3", "m1", "m5", "m2", "m4"}) {
    request.set_machine_id(id);
    ASSERT_TRUE(Create(request).ok());
  }
  std::vector<std::string> names;
  v1::ListMachinesRequest list;
  list.set_page_size(2);
  do {
    const auto page = Call(&v1::PlantService::Stub::ListMachines, list);
    ASSERT_TRUE(page.ok()) << page.status();
    for (const v1::Machine& machine : page->machines()) names.push_back(machine.name());
    list.set_page_token(page->next_page_token());
  } while (!list.page_token().empty());
  EXPECT_THAT(names, ElementsAre("machines/m1", "machines/m2", "machines/m3", "machines/m4", "machines/m5"));
}

TEST_F(PlantServiceTest, AListLeavesOutWhatOnlyItsFullViewHas) {
  ASSERT_TRUE(Create(SampleMachine()).ok());
  v1::ListMachinesRequest list;
  const auto basic = Call(&v1::PlantService::Stub::ListMachines, list);
  ASSERT_TRUE(basic.ok()) << basic.status();
  EXPECT_FALSE(basic->machines(0).has_kinematics());
  EXPECT_EQ(basic->machines(0).sensor().noise_um(), 2);
  list.set_view(list::v1::VIEW_FULL);
  const auto full = Call(&v1::PlantService::Stub::ListMachines, list);
  ASSERT_TRUE(full.ok()) << full.status();
  EXPECT_TRUE(MessageDifferencer::Equals(full->machines(0), *GetMachine("machines/m1")));
  list.set_view(static_cast<list::v1::View>(7));
  EXPECT_EQ(Call(&v1::PlantService::Stub::ListMachines, list).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(PlantServiceTest, BladesAreListedByPartAndTimeAndPages) {
  ASSERT_TRUE(Create(SamplePart(CylinderCad())).ok());
  v1::CreatePartRequest other = SamplePart(CylinderCad());
  other.set_part_id("other");
  ASSERT_TRUE(Create(other).ok());
  for (const char* serial : {"sn3", "sn1", "sn4"}) ASSERT_TRUE(CreateBlade(serial, "parts/vane").ok());
  const auto last = CreateBlade("sn2", "parts/other");
  ASSERT_TRUE(last.ok()) << last.status();
  const auto list = [&](v1::ListBladesRequest request) {
    std::vector<std::string> names;
    do {
      const auto page = Call(&v1::PlantService::Stub::ListBlades, request);
      EXPECT_TRUE(page.ok()) << page.status();
      if (!page.ok()) break;
      for (const v1::Blade& blade : page->blades()) names.push_back(blade.name());
      request.set_page_token(page->next_page_token());
    } while (!request.page_token().empty());
    return names;
  };
  v1::ListBladesRequest request;
  request.set_page_size(1);
  EXPECT_THAT(list(request), ElementsAre("blades/sn1", "blades/sn2", "blades/sn3", "blades/sn4"));
  request.set_part("parts/vane");
  EXPECT_THAT(list(request), ElementsAre("blades/sn1", "blades/sn3", "blades/sn4"));
  request.clear_part();
  *request.mutable_recorded()->mutable_from() = last->created_at();
  EXPECT_THAT(list(request), ElementsAre("blades/sn2"));
  request.clear_recorded();
  *request.mutable_recorded()->mutable_until() = last->created_at();
  EXPECT_THAT(list(request), ElementsAre("blades/sn1", "blades/sn3", "blades/sn4"));
  *request.mutable_recorded()->mutable_from() = last->created_at();
  EXPECT_THAT(list(request), ElementsAre());
  request.clear_recorded();
  request.set_serial_prefix("sn");
  EXPECT_THAT(list(request), ElementsAre("blades/sn1", "blades/sn2", "blades/sn3", "blades/sn4"));
  request.set_serial_prefix("sn3");
  EXPECT_THAT(list(request), ElementsAre("blades/sn3"));
  request.set_serial_prefix("%");
  EXPECT_THAT(list(request), ElementsAre());
  request.clear_serial_prefix();
  v1::ListBladesRequest of_results;  // nothing was judged or corrected
  of_results.set_verdict("CONFORM");
  EXPECT_THAT(list(of_results), ElementsAre());
  of_results.set_verdict("conform");
  EXPECT_EQ(Call(&v1::PlantService::Stub::ListBlades, of_results).status().code(), absl::StatusCode::kInvalidArgument);
  of_results.clear_verdict();
  of_results.set_state("CUT");
  EXPECT_THAT(list(of_results), ElementsAre());
  of_results.set_state("cut?");
  EXPECT_EQ(Call(&v1::PlantService::Stub::ListBlades, of_results).status().code(), absl::StatusCode::kInvalidArgument);
  request.set_machine("machines/m1");  // on which none of them was
  EXPECT_THAT(list(request), ElementsAre());
  request.clear_machine();
  request.mutable_recorded()->mutable_from()->set_seconds(last->created_at().seconds());
  request.mutable_recorded()->mutable_until()->set_seconds(last->created_at().seconds() - 10);
  EXPECT_EQ(Call(&v1::PlantService::Stub::ListBlades, request).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(PlantServiceTest, WhatIsNotThereIsNotFound) {
  const auto machine = GetMachine("machines/m9");
  EXPECT_EQ(machine.status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(runtime::ReasonOf(machine.status()), "MACHINE_NOT_FOUND");
  ASSERT_TRUE(Create(SampleMachine()).ok());
  EXPECT_EQ(GetMachine("machines/m1@2").status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(GetMachine("machines/m1@-1").status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(GetMachine("parts/m1").status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(GetPart("parts/p9").status().code(), absl::StatusCode::kNotFound);
}

TEST_F(PlantServiceTest, EndpointsTellWhereTheOthersAre) {
  const auto endpoints = Call(&v1::PlantService::Stub::ListEndpoints, v1::ListEndpointsRequest());
  ASSERT_TRUE(endpoints.ok());
  ASSERT_EQ(endpoints->endpoints_size(), 2);
  EXPECT_EQ(endpoints->endpoints(0).area(), "ingest");
  EXPECT_EQ(endpoints->endpoints(0).address(), "127.0.0.1:7401");
  EXPECT_FALSE(endpoints->software_version().empty());
}

}  // namespace
}  // namespace sixpoint::plant

// The handlers on fake stores: no PostgreSQL, and no CAD is read. What CAD becomes is tested in plant_service_test.cc.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "services/plant/plant_service.h"
#include "services/plant/record_service.h"
#include "services/plant/validate.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "storage/blobs.h"
#include "tests/services/plant/sample_registry.h"
#include "tests/support/call.h"
#include "tests/support/fake_plant_stores.h"
#include "tests/support/in_process_server.h"
#include "tests/support/sanitizer.h"
#include "tests/support/some_uuid.h"

namespace sixpoint::plant {
namespace {

using sixpoint::testing::kSomeUuid;
using testing::Call;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using PlantStub = v1::PlantService::Stub;

class PlantHandlersTest : public ::testing::Test {
 protected:
  absl::StatusOr<v1::Machine> Get(const std::string& name) {
    v1::GetMachineRequest request;
    request.set_name(name);
    return Call(*stub_, &PlantStub::GetMachine, request);
  }
  absl::StatusOr<v1::Blade> CreateBlade(const std::string& serial) {
    v1::CreateBladeRequest request;
    request.set_serial(serial);
    request.set_part("parts/vane");
    return Call(*stub_, &PlantStub::CreateBlade, request);
  }
  // As if its CAD had been read.
  void AddPart() {
    storage::PartRow part;
    part.part_id = "vane";
    part.cad_format = "step";
    part.zero_from_part_nominal_translation_mm = {0, 0, 0};
    AddPart(std::move(part));
  }
  void AddPart(storage::PartRow part) {
    storage::TessellationRow tessellation;
    tessellation.minimum_mm = tessellation.maximum_mm = {0, 0, 0};
    part.tessellation = *stores_.surfaces->Keep("cad", std::string(3 << 20, 's'), tessellation, "test", {});
    ASSERT_TRUE(stores_.parts->Record({}, part, {}, {}).ok());
  }

  static constexpr std::chrono::milliseconds kStreamPatience{1000};

  testing::FakePlantStores stores_;
  PlantService service_{{}, stores_};
  RecordService record_service_{stores_.journal, stores_.blades};
  testing::InProcessServer server_{{&service_, &record_service_}, 0, kStreamPatience};
  std::unique_ptr<PlantStub> stub_ = v1::PlantService::NewStub(server_.Connect());
  std::unique_ptr<v1::RecordService::Stub> record_stub_ = v1::RecordService::NewStub(server_.Connect());
};

TEST_F(PlantHandlersTest, AMachineIsRegisteredAndGotByItsRevisions) {
  v1::CreateMachineRequest request = SampleMachine();
  ASSERT_TRUE(Call(*stub_, &PlantStub::CreateMachine, request).ok());
  request.mutable_machine()->mutable_sensor()->set_noise_um(3);
  const auto second = Call(*stub_, &PlantStub::CreateMachine, request);
  EXPECT_EQ(second->revision(), 2);
  EXPECT_EQ(Get("machines/m1")->SerializeAsString(), second->SerializeAsString());
  EXPECT_EQ(Get("machines/m1@1")->sensor().noise_um(), 2);
  ASSERT_EQ(stores_.record->entries().size(), 2u);
  EXPECT_EQ(stores_.record->entries().back().entry.name, "machines/m1@2");
  EXPECT_NE(stores_.record->entries().back().entry.requested_by, "");
}

TEST_F(PlantHandlersTest, ARetryGetsTheKeptAnswer) {
  v1::CreateMachineRequest request = SampleMachine();
  request.set_request_id(kSomeUuid);
  const auto first = Call(*stub_, &PlantStub::CreateMachine, request);
  ASSERT_TRUE(first.ok()) << first.status();
  EXPECT_EQ(Call(*stub_, &PlantStub::CreateMachine, request)->SerializeAsString(), first->SerializeAsString());
  request.set_machine_id("m2");
  EXPECT_EQ(Call(*stub_, &PlantStub::CreateMachine, request).status().code(), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(stores_.record->entries().size(), 1u);
}

TEST_F(PlantHandlersTest, NothingIsRecordedOfWhatIsRefused) {
  v1::CreateMachineRequest machine = SampleMachine();
  machine.mutable_machine()->mutable_sensor()->set_noise_um(-1);
  EXPECT_THAT(std::string(Call(*stub_, &PlantStub::CreateMachine, machine).status().message()),
              HasSubstr("noise_um: -1"));
  EXPECT_EQ(runtime::ReasonOf(CreateBlade("sn1").status()), "PART_NOT_FOUND");
  EXPECT_EQ(CreateBlade("no serial").status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(runtime::ReasonOf(Get("machines/m1").status()), "MACHINE_NOT_FOUND");
  EXPECT_EQ(Get("scans/s1").status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_TRUE(stores_.record->entries().empty());
}

// A newer release's record, read by this one after it was rolled back.
TEST_F(PlantHandlersTest, AWordOfAnotherReleaseIsNoDefault) {
  storage::MachineRow machine;
  machine.machine_id = "m1";
  machine.nominal_centre_mm = {0, 0, 0};
  machine.joints.push_back({"part", "C", "polar", {0, 0, 1}, {}, 1, -90, 90, {}});
  ASSERT_TRUE(stores_.machines->Record({}, machine, {}, {}).ok());
  const absl::Status got = Get("machines/m1").status();
  EXPECT_EQ(got.code(), absl::StatusCode::kDataLoss) << got;
  EXPECT_THAT(std::string(got.message()), HasSubstr("machine m1: its JOINT_KIND_POLAR"));
  EXPECT_EQ(Call(*stub_, &PlantStub::ListMachines, v1::ListMachinesRequest()).status().code(),
            absl::StatusCode::kDataLoss);
  storage::PartRow part;
  part.part_id = "vane";
  part.cad_format = "step";
  part.zero_from_part_nominal_translation_mm = {0, 0, 0};
  part.hole_groups.emplace_back();
  part.hole_groups[0].axis_in_part = {0, 0, 1};
  part.hole_groups[0].position_zone = "ELLIPSE";
  AddPart(part);
  v1::GetPartRequest request;
  request.set_name("parts/vane");
  EXPECT_THAT(std::string(Call(*stub_, &PlantStub::GetPart, request).status().message()),
              HasSubstr("part vane: its POSITION_ZONE_ELLIPSE"));
}

TEST_F(PlantHandlersTest, ListsByPagesAndLeavesOutWhatOnlyTheFullViewHas) {
  v1::CreateMachineRequest machine = SampleMachine();
  for (const char* id : {"m2", "m1", "m3"}) {
    machine.set_machine_id(id);
    ASSERT_TRUE(Call(*stub_, &PlantStub::CreateMachine, machine).ok());
  }
  v1::ListMachinesRequest request;
  request.set_page_size(2);
  auto page = Call(*stub_, &PlantStub::ListMachines, request);
  ASSERT_EQ(page->machines_size(), 2);
  EXPECT_EQ(page->machines(1).name(), "machines/m2");
  EXPECT_FALSE(page->machines(1).has_kinematics());
  request.set_page_token(page->next_page_token());
  request.set_view(list::v1::VIEW_FULL);
  EXPECT_EQ(Call(*stub_, &PlantStub::ListMachines, request).status().code(), absl::StatusCode::kInvalidArgument);
  request.clear_view();
  page = Call(*stub_, &PlantStub::ListMachines, request);
  ASSERT_EQ(page->machines_size(), 1);
  EXPECT_EQ(page->next_page_token(), "");
  request.clear_page_token();
  request.set_view(list::v1::VIEW_FULL);
  EXPECT_TRUE(Call(*stub_, &PlantStub::ListMachines, request)->machines(0).has_kinematics());
}

TEST_F(PlantHandlersTest, ABladeIsInTheRecordAndRecalledByItsPart) {
  AddPart();
  ASSERT_TRUE(CreateBlade("sn1").ok());
  v1::GetBladeRecordRequest record;
  record.set_name("blades/sn1");
  const auto of_blade = Call(*record_stub_, &v1::RecordService::Stub::GetBladeRecord, record);
  ASSERT_TRUE(of_blade.ok()) << of_blade.status();
  EXPECT_EQ(of_blade->blade().part(), "parts/vane");
  EXPECT_THAT(of_blade->entries(0).inputs(), ElementsAre("parts/vane@1"));
  record.add_kinds("inspection");
  EXPECT_EQ(Call(*record_stub_, &v1::RecordService::Stub::GetBladeRecord, record)->entries_size(), 0);
  record.set_kinds(0, "inspections");
  EXPECT_THAT(std::string(Call(*record_stub_, &v1::RecordService::Stub::GetBladeRecord, record).status().message()),
              HasSubstr("kinds[0]: inspections"));
  record.clear_kinds();
  *record.mutable_recorded()->mutable_until() = of_blade->entries(0).recorded_at();
  EXPECT_EQ(Call(*record_stub_, &v1::RecordService::Stub::GetBladeRecord, record)->entries_size(), 0);
  *record.mutable_recorded()->mutable_from() = of_blade->entries(0).recorded_at();
  record.mutable_recorded()->mutable_until()->set_seconds(of_blade->entries(0).recorded_at().seconds() - 1);
  EXPECT_EQ(Call(*record_stub_, &v1::RecordService::Stub::GetBladeRecord, record).status().code(),
            absl::StatusCode::kInvalidArgument);
  v1::RecallRequest recall;
  recall.set_name("parts/vane");
  EXPECT_EQ(Call(*record_stub_, &v1::RecordService::Stub::Recall, recall)->entries(0).name(), "blades/sn1");
  recall.set_name("parts/p9");
  EXPECT_EQ(runtime::ReasonOf(Call(*record_stub_, &v1::RecordService::Stub::Recall, recall).status()),
            "RECORD_ENTRY_NOT_FOUND");
  v1::GetRecordEntryRequest entry;
  entry.set_name("parts/vane@1");
  EXPECT_EQ(Call(*record_stub_, &v1::RecordService::Stub::GetRecordEntry, entry)->kind(), "part");
}

TEST_F(PlantHandlersTest, ASurfaceComesInChunks) {
  AddPart();
  v1::DownloadSurfaceRequest request;
  request.set_name("parts/vane");
  const auto context = runtime::ContextFor(10);
  const auto reader = stub_->DownloadSurface(context.get(), request);
  v1::DownloadSurfaceResponse response;
  std::size_t byte_count = 0, chunk_count = 0;
  for (; reader->Read(&response); ++chunk_count) byte_count += response.chunk().size();
  EXPECT_TRUE(reader->Finish().ok());
  EXPECT_EQ(byte_count, std::size_t{3} << 20);
  EXPECT_EQ(chunk_count, 3u);
}

// Each holds a whole surface, and a thread.
TEST_F(PlantHandlersTest, WhoDoesNotReadASurfaceIsLetGo) {
  AddPart();
  v1::DownloadSurfaceRequest request;
  request.set_name("parts/vane");
  struct Reader {
    std::unique_ptr<grpc::ClientContext> context = runtime::ContextFor(sixpoint::testing::kPatience * 60);
    std::unique_ptr<grpc::ClientReader<v1::DownloadSurfaceResponse>> stream;
  };
  std::vector<Reader> idle(8);  // as many as there may be at once
  // gRPC itself reads no further ahead than the 64 KB that HTTP/2 begins with.
  grpc::ChannelArguments reads_little;
  reads_little.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  const auto slow_stub = v1::PlantService::NewStub(
      grpc::CreateCustomChannel(server_.address(), grpc::InsecureChannelCredentials(), reads_little));
  for (Reader& reader : idle) reader.stream = slow_stub->DownloadSurface(reader.context.get(), request);
  // Each has begun, however busy the machine is.
  for (Reader& reader : idle) reader.stream->WaitForInitialMetadata();
  const auto all_begun = std::chrono::steady_clock::now();
  // Waits for its turn, which comes once they are let go.
  const auto context = runtime::ContextFor(30);
  const auto begin = std::chrono::steady_clock::now();
  const auto reader = stub_->DownloadSurface(context.get(), request);
  v1::DownloadSurfaceResponse response;
  std::size_t byte_count = 0;
  while (reader->Read(&response)) byte_count += response.chunk().size();
  EXPECT_TRUE(reader->Finish().ok());
  EXPECT_EQ(byte_count, std::size_t{3} << 20);
  EXPECT_GT(std::chrono::steady_clock::now() - begin, kStreamPatience / 4);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 8 * kStreamPatience);
  // One that is read before its patience is out gets its surface.
  std::this_thread::sleep_until(all_begun + 5 * kStreamPatience);
  for (Reader& one : idle) {
    while (one.stream->Read(&response)) continue;
    EXPECT_EQ(one.stream->Finish().error_code(), grpc::StatusCode::CANCELLED);
  }
}

TEST_F(PlantHandlersTest, AMachiningModelHasRevisionsAndIsOfItsPart) {
  v1::CreateMachiningModelRequest request = SampleModel();
  EXPECT_EQ(runtime::ReasonOf(Call(*stub_, &PlantStub::CreateMachiningModel, request).status()), "PART_NOT_FOUND");
  AddPart(*Validated(SamplePart("cad")));
  const auto first = Call(*stub_, &PlantStub::CreateMachiningModel, request);
  ASSERT_TRUE(first.ok()) << first.status();
  EXPECT_EQ(first->name(), "machining_models/vane-edm");
  EXPECT_EQ(first->revision(), 1);
  EXPECT_EQ(first->part_revision(), 1);
  EXPECT_EQ(first->nc_template_sha256(), storage::Sha256Hex(request.machining_model().nc_template()));
  EXPECT_THAT(stores_.record->entries().back().entry.inputs, ElementsAre("parts/vane@1"));
  EXPECT_EQ(stores_.record->entries().back().entry.name, "machining_models/vane-edm@1");
  EXPECT_EQ(stores_.record->entries().back().entry.kind, "machining_model");
  // The same again, as it was answered, is the same revision.
  *request.mutable_machining_model() = *first;
  EXPECT_EQ(Call(*stub_, &PlantStub::CreateMachiningModel, request)->revision(), 1);
  request.mutable_machining_model()->mutable_operations(0)->mutable_electrode()->set_wear_mm(0);
  EXPECT_EQ(Call(*stub_, &PlantStub::CreateMachiningModel, request)->revision(), 2);
  v1::GetMachiningModelRequest get;
  get.set_name("machining_models/vane-edm@1");
  EXPECT_EQ(Call(*stub_, &PlantStub::GetMachiningModel, get)->SerializeAsString(), first->SerializeAsString());
  get.set_name("machining_models/vane-edm");
  EXPECT_EQ(Call(*stub_, &PlantStub::GetMachiningModel, get)->revision(), 2);
  get.set_name("machining_models/vane-edm@3");
  EXPECT_EQ(runtime::ReasonOf(Call(*stub_, &PlantStub::GetMachiningModel, get).status()), "MACHINING_MODEL_NOT_FOUND");
  get.set_name("parts/vane");
  EXPECT_EQ(Call(*stub_, &PlantStub::GetMachiningModel, get).status().code(), absl::StatusCode::kInvalidArgument);
  v1::ListMachiningModelsRequest list;
  const auto basic = Call(*stub_, &PlantStub::ListMachiningModels, list);
  ASSERT_EQ(basic->machining_models_size(), 1);
  EXPECT_EQ(basic->machining_models(0).revision(), 2);
  EXPECT_EQ(basic->machining_models(0).operations_size(), 0);
  list.set_view(list::v1::VIEW_FULL);
  const auto full = Call(*stub_, &PlantStub::ListMachiningModels, list);
  EXPECT_EQ(full->machining_models(0).operations_size(), 1);
  EXPECT_EQ(full->machining_models(0).nc_template(), "");
  list.set_part("parts/vane");
  EXPECT_EQ(Call(*stub_, &PlantStub::ListMachiningModels, list)->machining_models_size(), 1);
  list.set_part("parts/van");
  EXPECT_EQ(Call(*stub_, &PlantStub::ListMachiningModels, list)->machining_models_size(), 0);
  list.set_part("vane");
  EXPECT_EQ(Call(*stub_, &PlantStub::ListMachiningModels, list).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(PlantHandlersTest, NothingIsRecordedOfAModelThatDoesNotFitItsPart) {
  AddPart(*Validated(SamplePart("cad")));
  const std::size_t before = stores_.record->entries().size();
  v1::CreateMachiningModelRequest request = SampleModel();
  request.mutable_machining_model()->mutable_operations(0)->mutable_electrode()->set_diameter_mm(1);
  EXPECT_THAT(std::string(Call(*stub_, &PlantStub::CreateMachiningModel, request).status().message()),
              HasSubstr("machining_model.operations[0].electrode.diameter_mm: 1, want at most 0.44"));
  request = SampleModel();
  request.mutable_machining_model()->mutable_nc_template()->append("X1 (SIXPOINT G1/H4)\n");
  EXPECT_THAT(std::string(Call(*stub_, &PlantStub::CreateMachiningModel, request).status().message()),
              HasSubstr("machining_model.nc_template: line 4"));
  EXPECT_EQ(stores_.record->entries().size(), before);
}

TEST_F(PlantHandlersTest, SaysWhatTheStoreSays) {
  stores_.record->Fail(absl::UnavailableError("database: away"));
  EXPECT_EQ(Call(*stub_, &PlantStub::CreateMachine, SampleMachine()).status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(Get("machines/m1").status().code(), absl::StatusCode::kUnavailable);
  v1::RecallRequest recall;
  recall.set_name("parts/vane");
  EXPECT_EQ(Call(*record_stub_, &v1::RecordService::Stub::Recall, recall).status().code(),
            absl::StatusCode::kUnavailable);
}

}  // namespace
}  // namespace sixpoint::plant

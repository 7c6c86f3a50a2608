// What the PlantStores do, PostgreSQL's and the fakes that handlers are tested on.
#include "storage/plant_store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <functional>

#include "storage/blobs.h"
#include "tests/support/customers_parts.h"
#include "tests/support/fake_plant_stores.h"
#include "tests/support/registered.h"
#include "tests/support/some_uuid.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::kSomeUuid;
using sixpoint::testing::Soon;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

RecordEntry PlantEntry(const std::vector<std::string>& inputs = {}) {
  RecordEntry entry;
  entry.inputs = inputs;
  entry.software_version = "test";
  return entry;
}

MachineRow Machine(const std::string& id, char content = '0') {
  MachineRow row = sixpoint::testing::MachineOf(id, content);
  JointRow joint;
  joint.side = "part";
  joint.axis = "A";
  joint.kind = "rotary";
  joint.direction = {0, 1, 0};
  joint.point_mm = {{0, 0, 0}};
  joint.minimum = -100;
  joint.maximum = 100;
  row.joints = {joint};
  return row;
}

TessellationRow Tessellation() {
  TessellationRow row;
  row.method = "step v3";
  row.triangle_count = 12;
  row.chordal_error_um = 0.5;
  row.closed = true;
  row.minimum_mm = {0, 0, 0};
  row.maximum_mm = {1, 1, 1};
  return row;
}

template <typename Row>
absl::StatusOr<Row> RecordRow(ResultWriter<Row>& store, const Row& row, const std::string& request_id = "",
                              const std::string& bytes = "request", const RecordEntry& entry = PlantEntry()) {
  return store.Record({"plant.Call", request_id, bytes}, row, entry, Soon());
}

absl::StatusOr<BladeRow> RecordBlade(const PlantStores& plant, const std::string& serial, const std::string& part) {
  return RecordRow(*plant.blades, BladeRow{serial, part, {}}, "", "", PlantEntry({"parts/" + part + "@1"}));
}

// Two parts of one surface.
void AddParts(const PlantStores& plant) {
  const auto kept = plant.surfaces->Keep("cad", "surface", Tessellation(), "test", Soon());
  ASSERT_TRUE(kept.ok()) << kept.status();
  for (const char* id : {"p1", "p2"}) ASSERT_TRUE(RecordRow(*plant.parts, sixpoint::testing::PartOf(id, *kept)).ok());
}

std::vector<std::string> Names(const absl::StatusOr<std::vector<JournalEntry>>& entries) {
  EXPECT_TRUE(entries.ok()) << entries.status();
  std::vector<std::string> names;
  for (const JournalEntry& entry : *entries) names.push_back(entry.entry.name);
  return names;
}

// Clears somebody for something.
using ClearFor = std::function<void(const std::string& holder, const std::string& scope)>;

void OnBothWithClearances(const std::function<void(const PlantStores& plant, const ClearFor& clear)>& test) {
  {
    SCOPED_TRACE("the fake");
    const sixpoint::testing::FakePlantStores fake;
    test(fake, [&](const std::string& holder, const std::string& scope) {
      fake.fake_clearances->clearances.emplace(holder, scope);
    });
  }
  SCOPED_TRACE("PostgreSQL");
  sixpoint::testing::ThrowawayDatabase database;
  test(PlantIn(database.database()), [&](const std::string& holder, const std::string& scope) {
    sixpoint::testing::Clear(database.database(), holder, scope);
  });
}

// Each test runs on both.
void OnBothPlantStores(const std::function<void(const PlantStores& plant)>& test) {
  {
    SCOPED_TRACE("the fake");
    test(sixpoint::testing::FakePlantStores());
  }
  SCOPED_TRACE("PostgreSQL");
  sixpoint::testing::ThrowawayDatabase database;
  test(PlantIn(database.database()));
}

TEST(PlantStore, AnotherDescriptionIsANewRevisionAndTheSameIsNot) {
  OnBothPlantStores([](const PlantStores& plant) {
    const auto first = RecordRow(*plant.machines, Machine("m1", 'a'));
    ASSERT_TRUE(first.ok()) << first.status();
    EXPECT_EQ(RecordRow(*plant.machines, Machine("m1", 'a'), kSomeUuid)->recorded.sequence, first->recorded.sequence);
    ASSERT_TRUE(RecordRow(*plant.machines, Machine("m1", 'b')).ok());
    // A request that found its description there goes on giving that revision.
    EXPECT_EQ((**plant.machines->FindRecorded({"plant.Call", kSomeUuid, "request"}, Soon())).revision, 1);
    EXPECT_EQ((**plant.machines->Find("m1", 0, Soon())).revision, 2);
    const auto found = plant.machines->Find("m1", 1, Soon());
    EXPECT_EQ((**found).content_sha256, std::string(64, 'a'));
    EXPECT_EQ((**found).joints.size(), 1u);
    EXPECT_FALSE(plant.machines->Find("m1", 3, Soon())->has_value());
    EXPECT_FALSE(plant.machines->Find("m9", 0, Soon())->has_value());
    const auto entry = plant.journal->FindEntry("machines/m1@2", Soon());
    ASSERT_TRUE(entry.ok() && entry->has_value());
    EXPECT_EQ((**entry).entry.machine, "m1");
    EXPECT_EQ((**entry).entry.kind, "machine");
  });
}

TEST(PlantStore, TheSameRequestIsRecordedOnce) {
  OnBothPlantStores([](const PlantStores& plant) {
    const auto first = RecordRow(*plant.machines, Machine("m1", 'a'), kSomeUuid);
    ASSERT_TRUE(first.ok()) << first.status();
    EXPECT_EQ((**plant.machines->FindRecorded({"plant.Call", kSomeUuid, "request"}, Soon())).revision, 1);
    EXPECT_EQ(RecordRow(*plant.machines, Machine("m1", 'b'), kSomeUuid)->recorded.sequence, first->recorded.sequence);
    EXPECT_EQ(RecordRow(*plant.machines, Machine("m1"), kSomeUuid, "another").status().code(),
              absl::StatusCode::kAlreadyExists);
    EXPECT_EQ((**plant.machines->Find("m1", 0, Soon())).revision, 1);
  });
}

TEST(PlantStore, ListsTheNewestOfEachById) {
  OnBothPlantStores([](const PlantStores& plant) {
    for (const char* id : {"m3", "m1", "m2"}) ASSERT_TRUE(RecordRow(*plant.machines, Machine(id)).ok());
    ASSERT_TRUE(RecordRow(*plant.machines, Machine("m2", 'b')).ok());
    const auto listed = plant.machines->List({}, "m1", 1, Soon());
    ASSERT_TRUE(listed.ok()) << listed.status();
    ASSERT_EQ(listed->size(), 1u);
    EXPECT_EQ(listed->front().machine_id, "m2");
    EXPECT_EQ(listed->front().revision, 2);
    EXPECT_EQ(plant.machines->List({}, "", 10, Soon())->size(), 3u);
    EXPECT_THAT(*plant.artefacts->List({}, "", 10, Soon()), IsEmpty());
    // m1's only revision is older than m2's newest.
    TimeSpan recorded;
    recorded.from = listed->front().recorded.recorded_at;
    EXPECT_EQ(plant.machines->List({recorded, {}}, "", 10, Soon())->size(), 1u);
    std::swap(recorded.from, recorded.until);
    EXPECT_EQ(plant.machines->List({recorded, {}}, "", 10, Soon())->size(), 2u);
  });
}

TEST(PlantStore, ASurfaceIsKeptOnceAndAPartShowsIt) {
  OnBothPlantStores([](const PlantStores& plant) {
    AddParts(plant);
    const std::string cad_sha256 = Sha256Hex("cad");
    const auto known = plant.surfaces->Find(cad_sha256, "step v3", Soon());
    ASSERT_TRUE(known.ok() && known->has_value()) << known.status();
    EXPECT_EQ((**known).triangle_count, 12);
    EXPECT_FALSE(plant.surfaces->Find(cad_sha256, "step v4", Soon())->has_value());
    EXPECT_EQ(*plant.surfaces->Bytes((**known).surface_sha256, Soon()), "surface");
    EXPECT_EQ(plant.surfaces->Bytes(std::string(64, '0'), Soon()).status().code(), absl::StatusCode::kNotFound);
    EXPECT_TRUE(plant.surfaces->Keep("cad", "surface", Tessellation(), "test", Soon()).ok());
    EXPECT_EQ((**plant.parts->Find("p2", 0, Soon())).tessellation.surface_sha256, (**known).surface_sha256);
  });
}

TEST(PlantStore, ABladeIsOfOnePart) {
  OnBothPlantStores([](const PlantStores& plant) {
    AddParts(plant);
    const auto first = RecordBlade(plant, "sn1", "p1");
    ASSERT_TRUE(first.ok()) << first.status();
    EXPECT_EQ(RecordBlade(plant, "sn1", "p1")->recorded.sequence, first->recorded.sequence);
    EXPECT_EQ(RecordBlade(plant, "sn1", "p2").status().code(), absl::StatusCode::kAlreadyExists);
    EXPECT_EQ((**plant.blades->Find("sn1", Soon())).part_id, "p1");
    EXPECT_FALSE(plant.blades->Find("sn9", Soon())->has_value());
    ASSERT_TRUE(RecordBlade(plant, "sn2", "p2").ok());
    BladeFilter filter;
    EXPECT_EQ(plant.blades->List(filter, "sn1", 10, Soon())->blades.front().blade_serial, "sn2");
    filter.part_id = "p1";
    EXPECT_EQ(plant.blades->List(filter, "", 10, Soon())->blades.size(), 1u);
    filter.recorded.until = std::chrono::system_clock::now() - std::chrono::hours(1);
    EXPECT_THAT(plant.blades->List(filter, "", 10, Soon())->blades, IsEmpty());
  });
}

TEST(PlantStore, ACustomersPartIsForWhoIsCleared) {
  OnBothWithClearances([](const PlantStores& plant, const ClearFor& clear) {
    AddParts(plant);
    const Reader jane{"users/jane"}, jack{"users/jack"};
    const auto surface = plant.surfaces->Keep("cad", "surface", Tessellation(), "test", Soon());
    PartRow part = sixpoint::testing::PartOf("p3", *surface);
    part.customer_id = "acme";
    RecordEntry by_jane = PlantEntry(), by_jack = PlantEntry();
    by_jane.reader = jane;
    by_jack.reader = jack;
    const auto refused = RecordRow(*plant.parts, part, "", "request", by_jane).status();
    EXPECT_EQ(refused.code(), absl::StatusCode::kPermissionDenied) << refused;
    clear("users/jane", "customers/acme");
    ASSERT_TRUE(RecordRow(*plant.parts, part, "", "request", by_jane).ok());
    RecordEntry blade_entry = PlantEntry({"parts/p3@1"});
    blade_entry.reader = jane;
    ASSERT_TRUE(RecordRow(*plant.blades, BladeRow{"sn3", "p3", {}}, "", "", blade_entry).ok());
    const auto parts_of = [&](const Reader& reader) { return plant.parts->List({{}, reader}, "", 10, Soon())->size(); };
    BladeFilter filter;
    filter.reader = jane;
    EXPECT_EQ(parts_of(jane), 3u);
    EXPECT_EQ(plant.blades->List(filter, "", 10, Soon())->blades.size(), 1u);
    filter.reader = jack;
    EXPECT_EQ(parts_of(jack), 2u);
    EXPECT_THAT(plant.blades->List(filter, "", 10, Soon())->blades, IsEmpty());
    EXPECT_EQ(parts_of(Reader::Everything()), 3u);
    JournalPage recall;
    recall.reader = jane;
    EXPECT_THAT(Names(plant.journal->DerivedFrom("parts/p3", {}, recall, Soon())), ElementsAre("blades/sn3"));
    recall.reader = jack;
    EXPECT_THAT(Names(plant.journal->DerivedFrom("parts/p3", {}, recall, Soon())), IsEmpty());
    // What is there already is neither changed nor told by who does not see it.
    part.customer_id = "";
    part.content_sha256 = std::string(64, 'e');
    EXPECT_EQ(RecordRow(*plant.parts, part, "", "request", by_jack).status().code(),
              absl::StatusCode::kPermissionDenied);
    EXPECT_EQ(RecordRow(*plant.parts, part, "", "request", by_jane)->customer_id, "acme");
    blade_entry.reader = jack;
    const auto taken = RecordRow(*plant.blades, BladeRow{"sn3", "p1", {}}, "", "", blade_entry).status();
    EXPECT_EQ(taken.code(), absl::StatusCode::kPermissionDenied) << taken;
    const auto hidden = [&](const Reader& reader, const std::string& name, Unrecorded unrecorded) {
      return plant.clearances->FirstHidden(reader, {name}, unrecorded, Soon())->has_value();
    };
    for (const Unrecorded unrecorded : {Unrecorded::kIsHidden, Unrecorded::kIsSeen}) {
      EXPECT_TRUE(hidden(jack, "parts/p3", unrecorded));
      EXPECT_TRUE(hidden(jack, "blades/sn3", unrecorded));
      EXPECT_FALSE(hidden(jack, "parts/p1", unrecorded));
      EXPECT_FALSE(hidden(jane, "parts/none", unrecorded));
      EXPECT_EQ(hidden(jack, "parts/none", unrecorded), unrecorded == Unrecorded::kIsHidden);
    }
  });
}

MachiningModelRow Model(const std::string& id, const std::string& part, char content = '0') {
  MachiningModelRow row;
  row.machining_model_id = id;
  row.content_sha256 = std::string(64, content);
  row.part_id = part;
  row.part_revision = 1;
  row.operations = {{"OP10", "G2", 0.4, 60, 0.25}, {"OP20", "G1", 0.5, 80, 0}, {"OP30", "", 0.3, 50, 0}};
  MachiningToolPathRow fan;
  fan.path = "F1";
  fan.a_nominal_deg = -12.5;
  fan.b_nominal_deg = 30;
  fan.position_tolerance_mm = 0.05;
  fan.inclination_tolerance_deg = 0.5;
  fan.mouth_mm = 0.3;
  fan.tips_in_part_mm = {1, 2, 3, 1.1, 2, 3, 1.2, 2, 3.125};
  fan.axes_in_part = {0, 0, 1, 0.6, 0, 0.8, 0, -1, 0};
  row.operations.back().paths = {fan, fan};
  row.operations.back().paths.back().path = "F2";
  row.operations.back().paths.back().greatest_step_deg = 2;
  row.operations[0].tool_number = 7;
  row.operations[0].feed_mm_min = 2.5;
  PostProcessorRow& post = row.post_processor.emplace();
  post.axis_words = {"X", "Y", "Z", "C1", "B"};
  post.linear_decimals = 5;
  post.rotary_decimals = 6;
  post.direction_decimals = 8;
  post.explicit_plus = post.semicolon_comments = true;
  post.first_number = 10;
  post.number_step = 5;
  post.program_start = "%\nG21";
  post.operation_start = "T{tool} M6";
  post.hole = "G0 {x}";
  post.path_start = "G0 {y}";
  post.path_pose = "G1 {z}";
  post.path_end = "G0 Z50";
  post.operation_end = "M9";
  post.program_end = "M30";
  row.w_mm = 12.5;
  row.nc_template = "X1 (SIXPOINT G1/H1)\n";
  row.work_offsets = {{"G54", {1, 2, 3, 4, 5}}, {"G55", {0, 0, -0.125, 0, 0}}};
  row.tool_lengths = {{7, 120.5}, {8, 0}};
  return row;
}

TEST(PlantStore, AMachiningModelIsOfOnePartAndKeepsItsTemplate) {
  OnBothPlantStores([](const PlantStores& plant) {
    AddParts(plant);
    const auto record = [&](const MachiningModelRow& row) {
      return RecordRow(*plant.machining_models, row, "", "", PlantEntry({"parts/" + row.part_id + "@1"}));
    };
    const auto first = record(Model("edm", "p1"));
    ASSERT_TRUE(first.ok()) << first.status();
    EXPECT_EQ(record(Model("edm", "p1"))->recorded.sequence, first->recorded.sequence);
    MachiningModelRow bare = Model("edm", "p1", 'b');
    bare.w_mm.reset();
    bare.post_processor.reset();
    bare.work_offsets.clear();
    bare.tool_lengths.clear();
    ASSERT_TRUE(record(bare).ok());
    const auto found = plant.machining_models->Find("edm", 1, Soon());
    ASSERT_TRUE(found.ok() && found->has_value()) << found.status();
    EXPECT_EQ((*found)->nc_template, "X1 (SIXPOINT G1/H1)\n");
    EXPECT_EQ((*found)->nc_template_sha256, Sha256Hex("X1 (SIXPOINT G1/H1)\n"));
    EXPECT_EQ((*found)->part_id, "p1");
    EXPECT_EQ((*found)->part_revision, 1);
    EXPECT_EQ((*found)->w_mm, 12.5);
    ASSERT_EQ((*found)->operations.size(), 3u);
    EXPECT_EQ((*found)->operations[2].hole_group, "");
    EXPECT_THAT((*found)->operations[1].paths, IsEmpty());
    ASSERT_EQ((*found)->operations[2].paths.size(), 2u);
    const MachiningToolPathRow &fan = (*found)->operations[2].paths[0], &other = (*found)->operations[2].paths[1];
    EXPECT_EQ(fan.path, "F1");
    EXPECT_EQ(fan.a_nominal_deg, -12.5);
    EXPECT_EQ(fan.b_nominal_deg, 30);
    EXPECT_EQ(fan.position_tolerance_mm, 0.05);
    EXPECT_EQ(fan.inclination_tolerance_deg, 0.5);
    EXPECT_EQ(fan.mouth_mm, 0.3);
    EXPECT_FALSE(fan.greatest_step_deg.has_value());
    EXPECT_THAT(fan.tips_in_part_mm, ElementsAre(1, 2, 3, 1.1, 2, 3, 1.2, 2, 3.125));
    EXPECT_THAT(fan.axes_in_part, ElementsAre(0, 0, 1, 0.6, 0, 0.8, 0, -1, 0));
    EXPECT_EQ(other.path, "F2");
    EXPECT_EQ(other.greatest_step_deg, 2);
    EXPECT_EQ((*found)->operations[0].operation, "OP10");
    EXPECT_EQ((*found)->operations[0].hole_group, "G2");
    EXPECT_EQ((*found)->operations[0].electrode_diameter_mm, 0.4);
    EXPECT_EQ((*found)->operations[0].electrode_length_mm, 60);
    EXPECT_EQ((*found)->operations[0].electrode_wear_mm, 0.25);
    EXPECT_EQ((*found)->operations[0].tool_number, 7);
    EXPECT_EQ((*found)->operations[0].feed_mm_min, 2.5);
    EXPECT_FALSE((*found)->operations[1].tool_number.has_value());
    EXPECT_FALSE((*found)->operations[1].feed_mm_min.has_value());
    ASSERT_TRUE((*found)->post_processor.has_value());
    const PostProcessorRow& post = *(*found)->post_processor;
    EXPECT_THAT(post.axis_words, ElementsAre("X", "Y", "Z", "C1", "B"));
    EXPECT_THAT((std::vector<int>{post.linear_decimals, post.rotary_decimals, post.direction_decimals,
                                  post.first_number, post.number_step}),
                ElementsAre(5, 6, 8, 10, 5));
    EXPECT_THAT(
        (std::vector<bool>{post.explicit_plus, post.directions, post.semicolon_comments, post.leaves_out_repeated}),
        ElementsAre(true, false, true, false));
    EXPECT_THAT((std::vector<std::string>{post.program_start, post.operation_start, post.hole, post.path_start,
                                          post.path_pose, post.path_end, post.operation_end, post.program_end}),
                ElementsAre("%\nG21", "T{tool} M6", "G0 {x}", "G0 {y}", "G1 {z}", "G0 Z50", "M9", "M30"));
    ASSERT_EQ((*found)->work_offsets.size(), 2u);
    EXPECT_EQ((*found)->work_offsets[1].code, "G55");
    EXPECT_EQ((*found)->work_offsets[1].offset[2], -0.125);
    ASSERT_EQ((*found)->tool_lengths.size(), 2u);
    EXPECT_EQ((*found)->tool_lengths[0].number, 7);
    EXPECT_EQ((*found)->tool_lengths[0].length_mm, 120.5);
    const auto newest = plant.machining_models->Find("edm", 0, Soon());
    EXPECT_EQ((*newest)->revision, 2);
    EXPECT_FALSE((*newest)->w_mm.has_value());
    EXPECT_FALSE((*newest)->post_processor.has_value());
    EXPECT_THAT((*newest)->work_offsets, IsEmpty());
    // Another part's it never becomes.
    EXPECT_EQ(record(Model("edm", "p2")).status().code(), absl::StatusCode::kAlreadyExists);
    for (const bool full : {false, true}) {
      RegisteredFilter all;
      all.full = full;
      const auto listed = plant.machining_models->List(all, "", 10, Soon());
      ASSERT_EQ(listed->size(), 1u);
      EXPECT_EQ(listed->front().revision, 2);
      EXPECT_EQ(listed->front().nc_template, "") << "no list has it";
      ASSERT_EQ(listed->front().operations.size(), 3u);
      ASSERT_EQ(listed->front().operations[2].paths.size(), 2u);
      EXPECT_EQ(listed->front().operations[2].paths[1].path, "F2");
      EXPECT_THAT(listed->front().operations[2].paths[1].tips_in_part_mm, IsEmpty());
    }
    const auto entry = plant.journal->FindEntry("machining_models/edm@2", Soon());
    ASSERT_TRUE(entry.ok() && entry->has_value());
    EXPECT_EQ((*entry)->entry.kind, "machining_model");
    EXPECT_THAT(Names(plant.journal->DerivedFrom("parts/p1", {}, {}, Soon())),
                ElementsAre("machining_models/edm@1", "machining_models/edm@2"));
  });
}

TEST(PlantStore, ACustomersMachiningModelIsForWhoIsCleared) {
  OnBothWithClearances([](const PlantStores& plant, const ClearFor& clear) {
    AddParts(plant);
    const Reader jane{"users/jane"}, jack{"users/jack"};
    clear("users/jane", "customers/acme");
    const auto surface = plant.surfaces->Keep("cad", "surface", Tessellation(), "test", Soon());
    PartRow part = sixpoint::testing::PartOf("p3", *surface);
    part.customer_id = "acme";
    RecordEntry by_jane = PlantEntry(), by_jack = PlantEntry();
    by_jane.reader = jane;
    by_jack.reader = jack;
    ASSERT_TRUE(RecordRow(*plant.parts, part, "", "request", by_jane).ok());
    by_jane.inputs = {"parts/p3@1"};
    ASSERT_TRUE(RecordRow(*plant.machining_models, Model("edm", "p3"), "", "request", by_jane).ok());
    EXPECT_EQ(plant.machining_models->List({{}, jane}, "", 10, Soon())->size(), 1u);
    EXPECT_THAT(*plant.machining_models->List({{}, jack}, "", 10, Soon()), IsEmpty());
    EXPECT_EQ(plant.machining_models->List({{}, jane, "p3"}, "", 10, Soon())->size(), 1u);
    EXPECT_THAT(*plant.machining_models->List({{}, jane, "p1"}, "", 10, Soon()), IsEmpty());
    const auto hidden = [&](const Reader& reader, const std::string& name) {
      return plant.clearances->FirstHidden(reader, {name}, Unrecorded::kIsSeen, Soon())->has_value();
    };
    EXPECT_TRUE(hidden(jack, "machining_models/edm"));
    EXPECT_FALSE(hidden(jane, "machining_models/edm"));
    // Whose it is is not told by an id that is taken.
    const auto taken = RecordRow(*plant.machining_models, Model("edm", "p1"), "", "request", by_jack).status();
    EXPECT_EQ(taken.code(), absl::StatusCode::kPermissionDenied) << taken;
  });
}

TEST(PlantStore, TheJournalIsReadByNameBladeAndEdge) {
  OnBothPlantStores([](const PlantStores& plant) {
    AddParts(plant);
    for (const char* serial : {"sn1", "sn2"}) ASSERT_TRUE(RecordBlade(plant, serial, "p1").ok());
    EXPECT_TRUE(*plant.journal->IsRecorded("parts/p1", Soon()));
    EXPECT_TRUE(*plant.journal->IsRecorded("parts/p1@1", Soon()));
    EXPECT_FALSE(*plant.journal->IsRecorded("parts/p", Soon()));
    EXPECT_FALSE(plant.journal->FindEntry("parts/p1", Soon())->has_value());
    EXPECT_THAT(Names(plant.journal->RecordOfBlade("sn1", {}, {}, Soon())), ElementsAre("blades/sn1"));
    EXPECT_THAT(Names(plant.journal->RecordOfBlade("sn1", {"scan"}, {}, Soon())), IsEmpty());
    const Instant at = plant.journal->FindEntry("blades/sn1", Soon())->value().recorded.recorded_at;
    JournalPage span;
    span.recorded.until = at;
    EXPECT_THAT(Names(plant.journal->RecordOfBlade("sn1", {}, span, Soon())), IsEmpty());
    span.recorded = {at, at + std::chrono::microseconds(1)};
    EXPECT_THAT(Names(plant.journal->RecordOfBlade("sn1", {"blade"}, span, Soon())), ElementsAre("blades/sn1"));
    EXPECT_THAT(Names(plant.journal->DerivedFrom("parts/p1", {}, {}, Soon())), ElementsAre("blades/sn1", "blades/sn2"));
    EXPECT_THAT(Names(plant.journal->DerivedFrom("parts/p1", {"scan"}, {}, Soon())), IsEmpty());
    JournalPage page;
    page.limit = 1;
    const auto first = plant.journal->DerivedFrom("parts/p1@1", {"blade"}, page, Soon());
    EXPECT_THAT(Names(first), ElementsAre("blades/sn1"));
    page.after_sequence = first->front().recorded.sequence;
    EXPECT_THAT(Names(plant.journal->DerivedFrom("parts/p1", {}, page, Soon())), ElementsAre("blades/sn2"));
  });
}

TEST(PlantStore, KnowsEveryKindOfEntry) {
  std::vector<std::vector<std::string>> kinds;
  OnBothPlantStores([&](const PlantStores& plant) { kinds.push_back(plant.journal->Kinds(Soon()).value()); });
  ASSERT_EQ(kinds.size(), 2u);
  EXPECT_THAT(kinds[0], ::testing::UnorderedElementsAreArray(kinds[1]));
  EXPECT_THAT(kinds[0], ::testing::Contains("machining_pass"));
}

}  // namespace
}  // namespace sixpoint::storage

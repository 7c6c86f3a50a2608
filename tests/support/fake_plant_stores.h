// PlantStores in memory, about one journal: what handlers are tested on without PostgreSQL. Held to the real ones by
// tests/storage/plant_store_test.cc and drawing_store_test.cc.
#pragma once

#include <memory>

#include "storage/drawing_store.h"
#include "storage/plant_store.h"
#include "tests/support/fake_clearances.h"
#include "tests/support/fake_record.h"

namespace sixpoint::testing {

struct FakePlantStores : storage::PlantStores {
  FakePlantStores();
  std::shared_ptr<storage::DrawingStore> drawings;
  std::shared_ptr<FakeRecord> record = std::make_shared<FakeRecord>();
  std::shared_ptr<FakeClearances> fake_clearances = std::make_shared<FakeClearances>();
};

}  // namespace sixpoint::testing

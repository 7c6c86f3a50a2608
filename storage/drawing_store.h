// Drawings as the plant service keeps them (storage/plant_store.h says how).
#pragma once

#include <memory>

#include "storage/drawings.h"
#include "storage/plant_store.h"

namespace sixpoint::storage {

// Lists that are not full have no characteristics, nor what these name. Record answers ALREADY_EXISTS where the drawing is another part's.
using DrawingStore = RevisionStore<DrawingRow>;
// In PostgreSQL; the database lives longer.
std::shared_ptr<DrawingStore> DrawingsIn(Database* database);

}  // namespace sixpoint::storage

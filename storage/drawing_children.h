// What a drawing's revision consists of, in tables of its own.
#pragma once

#include <absl/status/status.h>

#include "storage/drawings.h"

namespace sixpoint::storage {

// Regions before the datum systems and characteristics that name them.
absl::Status InsertDrawingChildren(Transaction& transaction, const DrawingRow& drawing);
// Of drawing->drawing_id and its revision.
absl::Status ReadDrawingChildren(Transaction& transaction, DrawingRow* drawing);

}  // namespace sixpoint::storage

#include "storage/drawing_store.h"

#include "storage/postgres_revisions.h"

namespace sixpoint::storage {

std::shared_ptr<DrawingStore> DrawingsIn(Database* database) {
  using Drawings = PostgresRevisions<DrawingRow>;
  return std::make_shared<Drawings>(
      database, Drawings::Statements{InsertDrawing, FindDrawing, ListDrawingIds, FindListedDrawing, FindDrawing});
}

}  // namespace sixpoint::storage

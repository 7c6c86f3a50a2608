#include "services/plant/surfaces.h"

#include <algorithm>
#include <sstream>
#include <utility>

#include "metrology/mesh/mesh_bytes.h"
#include "metrology/mesh/skin.h"
#include "services/runtime/errors.h"
#include "services/runtime/server.h"
#include "services/runtime/stored_geometry.h"
#include "storage/blobs.h"

namespace sixpoint::plant {
namespace {

constexpr double kChordalErrorUm = 0.5;
// Counts up when the tessellation of the same CAD with the same parameters comes to differ.
constexpr char kMethodVersion[] = "v4";

std::string MethodOf(const CadFile& file) {
  std::ostringstream text;
  text.precision(17);
  text << file.format << ' ' << kMethodVersion;
  if (file.format == "stl") {
    text << " unit_mm=" << file.unit_mm;
  } else {
    text << " chordal_error_um=" << file.chordal_error_um;
  }
  // A name may be long; a journal's entry keeps 64 bytes of a method.
  if (!file.solid.empty()) text << " solid=" << storage::Sha256Hex(file.solid).substr(0, 24);
  return text.str();
}

// Triangles are their own edges.
storage::TessellationRow::EdgeGaps EdgeGapsOf(const metrology::TriangleMesh& mesh) {
  storage::TessellationRow::EdgeGaps gaps;
  gaps.healed_um = 1e3 * mesh.healed_mm;
  const auto widest = std::max_element(mesh.face_gaps_mm.begin(), mesh.face_gaps_mm.end());
  if (widest == mesh.face_gaps_mm.end() || !(*widest > 0)) return gaps;
  gaps.gap_um = 1e3 * double{*widest};
  gaps.gap_at_mm = runtime::RowMajor(mesh.vertices_mm[static_cast<std::size_t>(widest - mesh.face_gaps_mm.begin())]);
  return gaps;
}

absl::StatusOr<storage::TessellationRow> Summary(const std::string& mesh_bytes, bool has_edges) {
  const absl::StatusOr<metrology::TriangleMesh> mesh = metrology::MeshFromBytes(mesh_bytes);
  if (!mesh.ok()) return absl::InternalError("cad worker: " + std::string(mesh.status().message()));
  if (mesh->triangles.empty()) return absl::InternalError("cad worker: a mesh of 0 triangles, want at least one");
  storage::TessellationRow row;
  row.triangle_count = static_cast<std::int64_t>(mesh->triangles.size());
  row.chordal_error_um = mesh->chordal_error_um;
  row.closed = mesh->closed;
  const Eigen::AlignedBox3d bounds_mm = metrology::BoundsOf(*mesh);
  row.minimum_mm = runtime::RowMajor(bounds_mm.min());
  row.maximum_mm = runtime::RowMajor(bounds_mm.max());
  const metrology::MeshGaps gaps = metrology::GapsOf(*mesh);
  row.gaps = {gaps.degenerate_triangle_count, gaps.open_rim_count, gaps.open_rim_length_mm};
  if (has_edges) row.edge_gaps = EdgeGapsOf(*mesh);
  return row;
}

}  // namespace

Surfaces::Surfaces(CadWorkerOptions options, std::shared_ptr<storage::SurfaceStore> store, int worker_count)
    : options_(std::move(options)),
      store_(std::move(store)),
      files_at_once_({worker_count, 0}, "CAD files", errors::v1::CAD_WORKERS_BUSY) {}

absl::StatusOr<std::string> Surfaces::Read(const CadFile& file, const std::string& cad, storage::Deadline deadline,
                                           const std::function<bool()>& keep_going) {
  const auto slot = files_at_once_.Enter(deadline, keep_going);
  if (!slot.ok()) return slot.status();
  ++read_count_;
  return TessellateInWorker(options_, file, cad, keep_going);
}

absl::StatusOr<storage::TessellationRow> Surfaces::Of(const std::string& format, double unit_mm,
                                                      const std::string& solid, const std::string& cad,
                                                      storage::Deadline deadline,
                                                      const std::function<bool()>& keep_going) {
  const CadFile file{format, unit_mm, kChordalErrorUm, solid};
  const std::string method = MethodOf(file);
  absl::StatusOr<std::optional<storage::TessellationRow>> known =
      store_->Find(storage::Sha256Hex(cad), method, deadline);
  if (!known.ok()) return known.status();
  if (*known) return **std::move(known);
  const absl::StatusOr<std::string> mesh = Read(file, cad, deadline, keep_going);
  if (!mesh.ok()) return mesh.status();
  absl::StatusOr<storage::TessellationRow> row = Summary(*mesh, format != "stl");
  if (!row.ok()) return row.status();
  row->method = method;
  return store_->Keep(cad, *mesh, *std::move(row), runtime::SoftwareVersion(), deadline);
}

}  // namespace sixpoint::plant

// First hits of rays with the things that stand in the machine, in double. Lengths in mm; a shape has its own frame, a
// scene is in machine coordinates.
#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <vector>

#include "metrology/mesh/triangle_mesh.h"

namespace sixpoint::simulator {

struct Ray {
  Eigen::Vector3d origin_mm;
  Eigen::Vector3d direction;  // unit
};

struct Hit {
  double distance_mm = 0;
  Eigen::Vector3d normal;  // unit, outward
};

// Immutable; any number of threads.
class Shape {
 public:
  virtual ~Shape() = default;
  // The first hit nearer than limit_mm, in the shape's frame.
  virtual std::optional<Hit> Intersect(const Ray& ray, double limit_mm) const = 0;
};

class Sphere : public Shape {
 public:
  Sphere(const Eigen::Vector3d& centre_mm, double radius_mm) : centre_mm_(centre_mm), radius_mm_(radius_mm) {}
  std::optional<Hit> Intersect(const Ray& ray, double limit_mm) const override;

 private:
  Eigen::Vector3d centre_mm_;
  double radius_mm_;
};

// A round pin with a flat top at `top_mm`, reaching `length_mm` down against `axis`; its foot is open.
class Pin : public Shape {
 public:
  Pin(const Eigen::Vector3d& top_mm, const Eigen::Vector3d& axis, double radius_mm, double length_mm);
  std::optional<Hit> Intersect(const Ray& ray, double limit_mm) const override;

 private:
  Eigen::Vector3d top_mm_, axis_, middle_mm_;
  double radius_mm_, length_mm_, bound_mm_;
};

// Triangles under a bounding volume hierarchy (surface area heuristic, binned).
class TriangleShape : public Shape {
 public:
  explicit TriangleShape(const metrology::TriangleMesh& mesh);
  std::optional<Hit> Intersect(const Ray& ray, double limit_mm) const override;

 private:
  struct Node {
    Eigen::Vector3d low, high;
    std::uint32_t first = 0;  // first triangle of a leaf, else the second child (the first one follows its parent)
    std::uint32_t count = 0;  // triangles; 0: an inner node
  };
  struct Triangle {
    Eigen::Vector3d corner, edge1, edge2;
  };
  struct Item;
  void Build(std::vector<Item>& items, std::uint32_t begin, std::uint32_t end);

  std::vector<Node> nodes_;
  std::vector<Triangle> triangles_;
};

class Scene {
 public:
  void Add(std::shared_ptr<const Shape> shape, const Eigen::Isometry3d& machine_from_shape);
  // In machine coordinates; the nearest hit of all shapes.
  std::optional<Hit> Intersect(const Ray& ray, double limit_mm) const;

 private:
  struct Placed {
    std::shared_ptr<const Shape> shape;
    Eigen::Isometry3d machine_from_shape, shape_from_machine;
  };
  std::vector<Placed> shapes_;
};

}  // namespace sixpoint::simulator

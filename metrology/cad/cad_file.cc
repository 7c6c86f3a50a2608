#include "metrology/cad/cad_file.h"

#include <BRepBuilderAPI_Sewing.hxx>
#include <IGESControl_Reader.hxx>
#include <IGESData_IGESEntity.hxx>
#include <Interface_EntityIterator.hxx>
#include <Interface_Graph.hxx>
#include <Interface_InterfaceModel.hxx>
#include <STEPControl_Reader.hxx>
#include <StepBasic_Product.hxx>
#include <StepBasic_ProductDefinition.hxx>
#include <StepBasic_ProductDefinitionFormation.hxx>
#include <StepRepr_CharacterizedDefinition.hxx>
#include <StepRepr_PropertyDefinition.hxx>
#include <StepRepr_Representation.hxx>
#include <StepRepr_RepresentedDefinition.hxx>
#include <StepRepr_ShapeRepresentationRelationship.hxx>
#include <StepShape_ShapeDefinitionRepresentation.hxx>
#include <StepShape_SolidModel.hxx>
#include <TCollection_HAsciiString.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS_Shape.hxx>
#include <TransferBRep.hxx>
#include <Transfer_TransientProcess.hxx>
#include <XSControl_TransferReader.hxx>
#include <XSControl_WorkSession.hxx>
#include <iostream>
#include <vector>

#include "metrology/cad/bodies.h"
#include "metrology/cad/cad_refusal.h"

namespace sixpoint::metrology {
namespace {

constexpr int kGreatestFaceCount = 65535;
constexpr int kIgesSolid = 186;  // manifold solid B-rep object
constexpr double kSewingToleranceMm = 1e-3;
// Of faces that another system left apart, as far as an edge may lie off them (refinement.h).
constexpr double kGreatestSewingToleranceMm = 0.1;

std::string TextOf(const Handle(TCollection_HAsciiString) & text) {
  return text.IsNull() ? std::string() : std::string(text->ToCString(), static_cast<std::size_t>(text->Length()));
}

// The name of the product whose shape a representation is; empty: of none.
std::string ProductOf(const Interface_Graph& graph, const Handle(Standard_Transient) & representation) {
  for (Interface_EntityIterator users = graph.Sharings(representation); users.More(); users.Next()) {
    const auto defined = Handle(StepShape_ShapeDefinitionRepresentation)::DownCast(users.Value());
    if (defined.IsNull()) continue;
    const Handle(StepRepr_PropertyDefinition) property = defined->Definition().PropertyDefinition();
    if (property.IsNull()) continue;
    const Handle(StepBasic_ProductDefinition) definition = property->Definition().ProductDefinition();
    if (definition.IsNull() || definition->Formation().IsNull() || definition->Formation()->OfProduct().IsNull())
      continue;
    const Handle(StepBasic_Product) product = definition->Formation()->OfProduct();
    const std::string name = TextOf(product->Name());
    return name.empty() ? TextOf(product->Id()) : name;
  }
  return {};
}

// By its representation, or by the one that this is said to be equal to: not by one that places it.
std::string ProductOfSolid(const Interface_Graph& graph, const Handle(Standard_Transient) & solid) {
  for (Interface_EntityIterator users = graph.Sharings(solid); users.More(); users.Next()) {
    const auto representation = Handle(StepRepr_Representation)::DownCast(users.Value());
    if (representation.IsNull()) continue;
    if (std::string name = ProductOf(graph, representation); !name.empty()) return name;
    for (Interface_EntityIterator of = graph.Sharings(representation); of.More(); of.Next()) {
      if (!of.Value()->IsInstance(STANDARD_TYPE(StepRepr_ShapeRepresentationRelationship))) continue;
      const auto pair = Handle(StepRepr_ShapeRepresentationRelationship)::DownCast(of.Value());
      for (const Handle(StepRepr_Representation) & other : {pair->Rep1(), pair->Rep2()})
        if (std::string name = ProductOf(graph, other); !name.empty()) return name;
    }
  }
  return {};
}

std::vector<BodyName> NamesIn(XSControl_Reader* reader) {
  const Handle(XSControl_WorkSession) session = reader->WS();
  const Handle(Transfer_TransientProcess) transferred = session->TransferReader()->TransientProcess();
  const Handle(Interface_InterfaceModel) model = session->Model();
  const Interface_Graph graph(model);
  std::vector<BodyName> names;
  for (int i = 1; i <= model->NbEntities(); ++i) {
    const Handle(Standard_Transient) entity = model->Value(i);
    BodyName name{};
    if (const auto solid = Handle(StepShape_SolidModel)::DownCast(entity); !solid.IsNull()) {
      name.own = TextOf(solid->Name());
      name.product = ProductOfSolid(graph, solid);
    } else if (const auto body = Handle(IGESData_IGESEntity)::DownCast(entity);
               !body.IsNull() && body->TypeNumber() == kIgesSolid && body->HasName()) {
      name.own = TextOf(body->NameValue());
    } else {
      continue;
    }
    const TopoDS_Shape shape = TransferBRep::ShapeResult(transferred, entity);
    for (TopExp_Explorer at(shape, TopAbs_SOLID); at.More(); at.Next()) {
      name.body = at.Current().TShape().get();
      names.push_back(name);
    }
  }
  return names;
}

// Sews faces where they meet, and each closed face to itself; and those that another system left apart, where that loses no face.
void Sew(TopoDS_Shape* shape) {
  const int face_count = CountFaces(*shape);
  BRepBuilderAPI_Sewing sewing(kSewingToleranceMm);
  sewing.Add(*shape);
  sewing.Perform();
  if (CountFaces(sewing.SewedShape()) != face_count) return;
  const TopoDS_Shape sewed = sewing.SewedShape();
  if (sewing.NbFreeEdges() == 0) {
    *shape = sewed;
    return;
  }
  BRepBuilderAPI_Sewing wider(kGreatestSewingToleranceMm);
  wider.Add(*shape);
  wider.Perform();
  const bool whole = CountFaces(wider.SewedShape()) == face_count && wider.NbDeletedFaces() == 0 &&
                     wider.NbDegeneratedShapes() == 0 && wider.NbMultipleEdges() == 0;
  *shape = whole && wider.NbFreeEdges() < sewing.NbFreeEdges() ? wider.SewedShape() : sewed;
}

absl::Status Transfer(IFSelect_ReturnStatus read, CadFormat format, const std::string& solid, XSControl_Reader* reader,
                      TopoDS_Shape* shape) {
  const bool step = format == CadFormat::kStep;
  if (read != IFSelect_RetDone) return RefuseCad("content", "unreadable", step ? "a STEP file" : "an IGES file");
  reader->TransferRoots();
  if (reader->NbShapes() < 1) return RefuseCad("content", "no shape", "a solid, shell or face");
  *shape = reader->OneShape();
  const int face_count = CountFaces(*shape);
  if (face_count < 1) return RefuseCad("faces", "0", "at least one");
  if (face_count > kGreatestFaceCount) return RefuseCad("faces", std::to_string(face_count), "at most 65535");
  // Most IGES knows faces only.
  if (!step && !TopExp_Explorer(*shape, TopAbs_SOLID).More()) Sew(shape);
  return ChooseBody(solid, NamesIn(reader), shape);
}

}  // namespace

absl::Status ReadCad(CadFormat format, const std::string& path, const std::string& solid, TopoDS_Shape* shape) {
  if (format == CadFormat::kStep) {
    STEPControl_Reader reader;
    const IFSelect_ReturnStatus read = path.empty() ? reader.ReadStream("", std::cin) : reader.ReadFile(path.c_str());
    return Transfer(read, format, solid, &reader, shape);
  }
  IGESControl_Reader reader;
  return Transfer(reader.ReadFile(path.c_str()), format, solid, &reader,
                  shape);  // its parser takes an empty path as we do
}

}  // namespace sixpoint::metrology

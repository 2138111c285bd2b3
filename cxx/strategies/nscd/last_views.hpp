// Views of the last step that the next one overwrites: reactions, impulses and stresses of meshes, and contacts. An
// undone step restores them, both for loads of its parts and for whoever catches its error.
#pragma once
#include <string_view>
#include <vector>

#include "../../simulation/simulation.hpp"

namespace cairn {

class LastViews {
public:
  // Before a step overwrites them. contacts_too: fields of contacts as well, see the source.
  void keep(Simulation& s, bool contacts_too);
  // After a step that was undone: they are read again.
  void show(Simulation& s);
  // Contacts of another step were detected: those kept are read no more.
  void hide() {
    if (contacts_ == Contacts::read) contacts_ = Contacts::kept;
  }
  // Bodies or materials changed, so that fields of contacts mean nothing any more.
  void forget() { contacts_ = Contacts::none; }
  // Stresses and reactions of a mesh whose step did not begin.
  void put_back_meshes(Simulation& s) const;
  // A field of contacts, zero where none is kept, and their status.
  void read(Simulation& s, std::string_view field, int components, double* out) const;
  void status(Simulation& s, std::int32_t* out) const;

private:
  enum class Contacts { none, kept, read };
  Contacts contacts_ = Contacts::none;
  Array<double> reaction_; // of bodies
  std::vector<MeshBody::Results> meshes_;
  Candidates candidates_;
  std::vector<std::int64_t> contactors_; // ids (2, contacts)
  std::vector<std::vector<double>> fields_;
  std::vector<std::int32_t> status_;
};

} // namespace cairn

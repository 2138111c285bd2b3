// Contacts with sides that flush bodies cover.
#pragma once
#include "dropped_contacts.hpp"

namespace cairn::detection {

class Seams {
public:
  explicit Seams(const PlacedScene& scene) : scene_(scene) {}
  void begin(); // a call; nothing of the last one is left
  void drop(DeclaredPairs& declared, DroppedContacts& dropped, Candidates& out);

private:
  bool may_have_seams() const;
  std::int32_t find_runs(const Candidates& out);
  std::int32_t list_runs(const Candidates& out, std::int32_t runs);
  bool judge(const Candidates& out);
  void apply(DeclaredPairs& declared, DroppedContacts& dropped, Candidates& out);
  void turn_contact(Candidates& out, std::int64_t i, bool of_b, const double* normal) const;

  const PlacedScene& scene_;
  std::int32_t entries_ = 0;
  ScratchArray<std::int64_t> run_;
  ScratchArray<std::int32_t> runs_of_, runs_start_;
  ScratchArray<std::int8_t> verdict_, runs_close_, mark_;
  ScratchArray<double> normal_, runs_speed_;
};

} // namespace cairn::detection

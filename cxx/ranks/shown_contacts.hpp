// Contacts of ranks that can be read.
#pragma once
#include <string_view>
#include <vector>

#include "part.hpp"

namespace cairn {

class ShownContacts {
public:
  explicit ShownContacts(bool networks); // true: fields that networks read are kept too
  bool networks() const { return networks_; }
  // Contacts of a part for which owns(contactor, contactor) is true.
  template <class F>
  void add(Part& part, F&& owns) {
    part.strategy->view(*part.simulation);
    if (!part.simulation->contacts_known) return;
    const Candidates& c = part.simulation->candidates;
    std::vector<std::size_t> rows;
    for (std::size_t i = 0; i < std::size_t(c.count); ++i)
      if (owns(c.contactor_a[i], c.contactor_b[i])) rows.push_back(i);
    add_rows(part, rows);
  }
  // The same over processes, as bytes and back.
  void pack(int dim, Packer& packer);
  void add_packed(Piece bytes, int dim);
  // To the candidates of the whole, in the order of their keys.
  void show(Simulation& s);
  static bool keeps(std::string_view field);
  const std::vector<double>* numbers(std::string_view field) const; // null: they are not kept
  const std::vector<std::int32_t>& status() const { return status_; }

private:
  void add_rows(Part& part, const std::vector<std::size_t>& rows);
  template <class F>
  void each_numbers(int dim, F&& f);

  bool networks_;
  std::vector<ContactKey> key_;
  std::vector<double> gap_, normal_, point_;
  std::vector<std::vector<double>> field_; // numbers of the fields that are kept
  std::vector<std::int32_t> status_;
};

} // namespace cairn

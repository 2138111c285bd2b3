// Contacts of all ranks as the contacts of one: each rank packs what its batches hold, and one of them lays out batches
// of all. Their order follows from colours and keys alone, so that no bit depends on which rank had which.
#pragma once
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "../bodies/body.hpp"
#include "../solvers/sweeps/contact_system.hpp"
#include "colouring.hpp"
#include "exchange.hpp"

namespace cairn {

// What a rank gives, and how it takes the answer.
class ContactParcel {
public:
  // own: (bodies) 1 where the rank owns them.
  ContactParcel(ContactSystem& system, const Bodies& bodies, const ColourShare& colours,
                const std::vector<std::uint8_t>& own);
  // start: impulses before the sweeps of the step, contact by contact; empty: they are not asked for.
  Bytes pack(std::span<const double> start) const;
  // Impulses into the batches, with the biases that the solver left of rings of bonds which do not close; velocities
  // into the records: those of bodies without contacts are free.
  void unpack(Unpacker& answer);
  // Bytes of the contacts of a system in a parcel.
  static double bytes_of(const ContactSystem& system);

private:
  ContactSystem& system_;
  const Bodies& bodies_;
  const ColourShare& colours_;
  std::vector<std::int32_t> touched_, others_; // local numbers of bodies with contacts of the rank, and of own without
};

// The contacts of all parcels.
class GatheredContacts {
public:
  explicit GatheredContacts(int dim);
  // parcels: by rising rank.
  void lay_out(const std::vector<Bytes>& parcels);
  // For each parcel: impulses of its contacts, velocities of its bodies.
  std::vector<Bytes> answers() const;
  ContactSystem& system() { return system_; }
  const std::vector<double>& start() const { return start_; } // impulses before the sweeps, batch by batch
  // Free velocities of nodes on which contacts rest; null: there are none.
  void see_nodes(const Field<double>* velocity_free) { nodes_free_ = velocity_free; }
  Velocities velocity_free() const { return {velocity_free_, nodes_free_}; }

private:
  struct Given;
  struct Place { // of a contact
    std::int32_t parcel, contact, batch, lane;
  };
  void number_bodies(const std::vector<Given>& given);
  void plan(const std::vector<Given>& given);
  void lay_out_numbers(const std::vector<Given>& given);
  void fill(const std::vector<Given>& given);
  std::int32_t number_of(std::int64_t id) const; // -1: it has no contact

  ContactSystem system_;
  Field<double> velocity_free_;
  const Field<double>* nodes_free_ = nullptr;
  std::vector<std::int64_t> id_; // of bodies, rising
  std::vector<cairn_law_context> context_;
  Array<double> number_;
  Array<std::int32_t> body_a_, body_b_, status_, index_;
  std::vector<double> start_;
  std::vector<Place> place_;                     // in the order of batches
  std::vector<std::vector<std::int64_t>> asked_; // ids of bodies whose velocity a parcel asks for
};

} // namespace cairn

// Meshes as solvers see them: compliance between the nodes that contacts rest on, and between means of nodes.
#include <algorithm>

#include "../bodies/body.hpp"
#include "condensed_meshes.hpp"

namespace cairn {

void CondensedMeshes::resize(std::size_t meshes) {
  wanted_.resize(meshes);
  wanted_means_.resize(meshes);
  direct_.resize(meshes);
}

void CondensedMeshes::want(const MeshList& meshes, const NodeMeans& means, const Mapping& m,
                           const MeshBody::Bytes& bytes) {
  std::vector<std::int32_t>& wanted = wanted_[std::size_t(m.mesh)];
  const MeshBody& mesh = meshes[std::size_t(m.mesh)];
  const bool all = mesh.may_exceed(bytes.easy); // what the step needs decides
  if (m.mean >= 0) {
    for (std::size_t e = means.begin(m.mean); e < means.end(m.mean); ++e)
      if (all || mesh.place(means.node[e]) < 0) wanted.push_back(means.node[e]);
    if (mean_row_[std::size_t(m.mean)] < 0) wanted_means_[std::size_t(m.mesh)].push_back(m.mean);
    mean_row_[std::size_t(m.mean)] = 0; // until it is known
    return;
  }
  for (int j = 0; j < 4 && m.node[j] >= 0; ++j) {
    if (all || mesh.place(m.node[j]) < 0) wanted.push_back(m.node[j]);
    direct_[std::size_t(m.mesh)].push_back(m.node[j]);
  }
}

void CondensedMeshes::condense(MeshList& meshes, const NodeMeans& means, const MeshBody::Bytes& bytes,
                               std::vector<CondensedBody>& out, Array<double>& velocity, bool keep_nodes) {
  out.resize(meshes.size());
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    MeshBody& mesh = meshes[i];
    std::vector<std::int32_t>& wanted = wanted_[i];
    if (!wanted.empty() && mesh.model.dofs() <= small_condensed) {
      wanted.resize(std::size_t(mesh.model.nodes()));
      for (std::size_t k = 0; k < wanted.size(); ++k) wanted[k] = std::int32_t(k);
    }
    if (mesh.may_exceed(bytes.easy)) {
      std::sort(wanted.begin(), wanted.end());
      wanted.erase(std::unique(wanted.begin(), wanted.end()), wanted.end());
      mesh.rest_on(wanted, bytes, wanted_means_[i].empty());
    } else {
      mesh.touch(wanted);
    }
    wanted.clear();
    take_rows(meshes, means, i, out[i], keep_nodes);
  }
  make_room(meshes, out, velocity);
}

void CondensedMeshes::condense_again(MeshList& meshes, const NodeMeans& means, std::vector<CondensedBody>& out,
                                     Array<double>& velocity) {
  for (MeshBody& mesh : meshes) mesh.touch({});
  for (std::size_t i = 0; i < out.size(); ++i)
    if (out[i].row.empty()) take_rows(meshes, means, i, out[i], false);
  make_room(meshes, out, velocity);
}

// Rows of a body: its contact nodes; where contacts act on weighted means of nodes, the nodes of other contacts first,
// then the means. With few nodes the rows are those of this step alone: contacts then store their effect on the body
// themselves, instead of sums by the body, and a restart from a file, which does not know nodes touched earlier, has
// the same rows.
void CondensedMeshes::take_rows(MeshList& meshes, const NodeMeans& all, std::size_t which, CondensedBody& body,
                                bool keep_nodes) {
  MeshBody& mesh = meshes[which];
  body.mean_start.clear();
  body.row.clear();
  std::vector<std::int32_t>&direct = direct_[which], &means = wanted_means_[which];
  for (const std::int32_t m : means)
    if (keep_nodes)
      direct.insert(direct.end(), all.node.begin() + all.start[std::size_t(m)],
                    all.node.begin() + all.start[std::size_t(m) + 1]);
  std::sort(direct.begin(), direct.end());
  direct.erase(std::unique(direct.begin(), direct.end()), direct.end());
  const bool few = !direct.empty() && mesh.model.dim * std::int64_t(direct.size()) <= small_condensed &&
                   mesh.model.dofs() > small_condensed && !mesh.reaches();
  if (means.empty() && !few) {
    direct.clear();
    body.node.resize(std::size_t(mesh.contact_nodes()));
    for (std::size_t k = 0; k < body.node.size(); ++k) body.node[k] = mesh.node(mesh.contact_node(std::int64_t(k)));
    return;
  }
  body.row.assign(std::size_t(mesh.model.nodes()), -1);
  body.node.clear();
  for (const std::int32_t node : direct) {
    body.row[std::size_t(node)] = std::int32_t(body.node.size());
    body.node.push_back(mesh.node(node));
  }
  if (means.empty()) return direct.clear();
  body.mean_start.assign(1, 0);
  body.mean_node.clear();
  body.mean_weight.clear();
  for (const std::int32_t m : means) {
    mean_row_[std::size_t(m)] = std::int32_t(body.node.size() + body.means());
    for (std::size_t e = all.begin(m); e < all.end(m); ++e) {
      body.mean_node.push_back(mesh.node(all.node[e]));
      body.mean_weight.push_back(all.weight[e]);
    }
    body.mean_start.push_back(std::int32_t(body.mean_node.size()));
  }
  direct.clear();
  means.clear();
}

void CondensedMeshes::make_room(MeshList& meshes, std::vector<CondensedBody>& out, Array<double>& velocity) {
  std::size_t room = 0;
  for (std::size_t i = 0; i < out.size(); ++i) {
    MeshBody& mesh = meshes[i];
    CondensedBody& body = out[i];
    const auto rows = std::int64_t(body.node.size() + body.means());
    body.dofs = {mesh.model.dim * rows, mesh.leading(), nullptr, mesh.compliance(), nullptr};
    body.mass = mesh.mass();
    body.touching = mesh.touching();
    body.inverse_mass = mesh.inverse_mass();
    if (!body.row.empty()) mix(mesh, body);
    if (const UnitReaches* reaches = mesh.reaches(); reaches && rows > 0) {
      body.reach = {
          reaches->equations,    reaches->unit, reaches->first.data(), reaches->place.data(), reaches->length.data(),
          reaches->value.data(), nullptr};
      body.dofs.reach = &body.reach;
    }
    room += condensed_rows(std::int64_t(body.moving()));
  }
  fit(velocity, room);
  std::fill(velocity.begin(), velocity.end(), 0.0);
  room = 0;
  for (CondensedBody& body : out) {
    body.dofs.velocity = velocity.data() + room;
    if (body.dofs.reach) body.reach.y = body.dofs.velocity + condensed_rows(body.dofs.dofs);
    room += condensed_rows(std::int64_t(body.moving()));
  }
}

// P S P' with the weights P of the rows.
void CondensedMeshes::mix(MeshBody& mesh, CondensedBody& body) {
  const int dim = mesh.model.dim;
  const auto from = std::size_t(mesh.leading()), all = std::size_t(dim * mesh.contact_nodes()),
             leading = condensed_rows(body.dofs.dofs), rows = body.node.size() + body.means();
  const double* given = mesh.compliance();
  fit(body.compliance, leading * std::size_t(body.dofs.dofs));
  std::fill(body.compliance.begin(), body.compliance.end(), 0.0);
  columns_.resize(std::max(columns_.size(), std::size_t(dim) * all));
  const auto place = [&](std::int32_t node) { return std::size_t(dim * mesh.place(node - mesh.node(0))); };
  for (std::size_t j = 0; j < rows; ++j) {
    std::fill_n(columns_.begin(), std::size_t(dim) * all, 0.0);
    body.each_node(j, [&](std::int32_t node, double weight) {
      for (std::size_t b = 0; b < std::size_t(dim); ++b) {
        const double* column = given + from * (place(node) + b);
        for (std::size_t l = 0; l < all; ++l) columns_[all * b + l] += weight * column[l];
      }
    });
    for (std::size_t i = 0; i < rows; ++i)
      body.each_node(i, [&](std::int32_t node, double weight) {
        const std::size_t at = place(node);
        for (std::size_t b = 0; b < std::size_t(dim); ++b)
          for (std::size_t a = 0; a < std::size_t(dim); ++a)
            body.compliance[leading * (std::size_t(dim) * j + b) + std::size_t(dim) * i + a] +=
                weight * columns_[all * b + at + a];
      });
  }
  body.dofs.leading = std::int64_t(leading);
  body.dofs.compliance = body.compliance.data();
}

} // namespace cairn

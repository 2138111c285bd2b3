#include "stored_tree.hpp"

#include <algorithm>
#include <charconv>
#include <limits>
#include <set>
#include <stdexcept>

#include "checksums.hpp"
#include "growing_file.hpp"
#include "hdf5_node.hpp"

namespace cairn {

namespace {

const char* const format_name = "cairn-checkpoint";
constexpr std::int64_t tree_version[2] = {1, 1}; // the first changes when older programs can no longer read it

[[noreturn]] void malformed(const std::string& what) { throw std::invalid_argument(what); }

StoredValue of_json(const std::string& text) {
  return {
      "json", StoredArray::of(reinterpret_cast<const unsigned char*>(text.data()), {std::int64_t(text.size())}), {}};
}
std::string json_of(const StoredValue& value) { return {value.array.bytes.begin(), value.array.bytes.end()}; }

// Types as numpy names them, which the checksum takes in.
std::string numpy_name(StoredType t) {
  const bool ordered = t.item > 1 && t.kind != 'S';
  return std::string(1, ordered ? '<' : '|') + t.kind + std::to_string(t.item);
}

// one_as_row: numbers alone were taken in as rows of one, up to version 1.0.
void take_in(Blake2b& digest, const std::string& place, const std::string& kind, const StoredArray& array,
             const unsigned char* bytes, bool one_as_row = false) {
  std::string shape = array.shape.empty() && one_as_row ? "(1," : "(";
  for (std::size_t k = 0; k < array.shape.size(); ++k) shape += (k ? ", " : "") + std::to_string(array.shape[k]);
  shape += array.shape.size() == 1 ? ",)" : ")";
  digest.update(place + "|" + kind + "|" + numpy_name(array.type) + "|" + shape + "|");
  digest.update(bytes, std::size_t(array.size()) * array.type.item);
}

std::vector<const StoredMember*> by_name(const std::vector<StoredMember>& members) {
  std::vector<const StoredMember*> out;
  out.reserve(members.size());
  for (const auto& m : members) out.push_back(&m);
  std::sort(out.begin(), out.end(), [](auto* a, auto* b) { return a->name < b->name; });
  return out;
}

void store(Group& group, const StoredValue& tree, Blake2b& digest, const std::string& place) {
  for (const auto* member : by_name(tree.members)) {
    const auto& [name, value] = *member;
    const std::string here = std::string(place).append("/").append(name);
    if (value.is_tree()) {
      digest.update(here + "|dict|");
      store(group.group(name), value, digest, here);
    } else {
      group.array(name, value.array, {{"kind", StoredArray::text(value.kind)}});
      take_in(digest, here, value.kind, value.array, value.array.bytes.data());
    }
  }
}

std::string text_of(const std::optional<StoredArray>& a) {
  if (!a || a->type.kind != 'S' || a->size() != 1) return "";
  const std::string all(a->bytes.begin(), a->bytes.end());
  return all.substr(0, all.find('\0'));
}

struct Reading {
  Blake2b& digest;
  bool one_as_row;
  std::uint64_t stays_from; // bytes
  std::set<std::uint64_t> seen{};
};

// An array, which stays in the file if it is large.
StoredValue value_of(const Hdf5Node& member, const Reading& how) {
  StoredValue value{text_of(member.attribute("kind")), {}, {}};
  value.array.type = member.type();
  value.array.shape = member.shape();
  const auto bytes = std::uint64_t(value.array.size()) * value.array.type.item;
  if (value.kind == "array" && bytes >= how.stays_from) value.mapped = member.mapped();
  if (!value.mapped) value.array = member.read();
  return value;
}

StoredValue read(const Hdf5Node& group, const std::string& place, Reading& how) {
  StoredValue out;
  std::vector<std::string> names = group.names();
  std::sort(names.begin(), names.end());
  for (const std::string& name : names) {
    const Hdf5Node member = group.child(name);
    const std::string here = std::string(place).append("/").append(name);
    if (!how.seen.insert(member.address()).second) malformed(here + " stands under two names");
    if (member.is_group()) {
      how.digest.update(here + "|dict|");
      out.add(name, read(member, here, how));
      continue;
    }
    StoredValue value = value_of(member, how);
    if (value.kind.empty()) malformed(here + " has no kind");
    const unsigned char* const bytes = value.mapped ? value.mapped.get() : value.array.bytes.data();
    take_in(how.digest, here, value.kind, value.array, bytes, how.one_as_row);
    if (value.kind == "flags" || value.kind == "flag") value.array.type.kind = 'b';
    out.add(name, std::move(value));
  }
  return out;
}

} // namespace

void StoredValue::add(const std::string& name, StoredValue value) { members.push_back({name, std::move(value)}); }

const StoredValue* StoredValue::find(const std::string& name) const {
  for (const auto& [known, value] : members)
    if (known == name) return &value;
  return nullptr;
}

const StoredValue& StoredValue::at(const std::string& name) const {
  const StoredValue* value = find(name);
  if (!value) malformed(name + " is missing");
  return *value;
}

const StoredValue& StoredValue::tree(const std::string& name) const {
  const StoredValue& value = at(name);
  if (!value.is_tree()) malformed(name + " holds no names");
  return value;
}

std::int64_t StoredValue::whole(const std::string& name, std::int64_t most) const {
  const StoredValue& value = at(name);
  std::int64_t n = -1;
  bool read = false;
  if (value.kind == "json") {
    const std::string text = json_of(value);
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), n);
    read = error == std::errc() && end == text.data() + text.size();
  } else if (value.kind == "number" && (value.array.type.kind == 'i' || value.array.type.kind == 'u')) {
    n = numbers_of<std::int64_t>(value.array, name).at(0);
    read = true;
  }
  if (!read || n < 0 || n >= most)
    malformed(name + " is " +
              (read                   ? std::to_string(n)
               : value.kind == "json" ? json_of(value)
                                      : "no whole number") +
              ": a whole number from 0 on is due");
  return n;
}

double StoredValue::real(const std::string& name) const {
  const StoredValue& value = at(name);
  if (value.kind == "json") {
    const std::string text = json_of(value);
    double x = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), x);
    if (error == std::errc() && end == text.data() + text.size()) return x;
  }
  if ((value.kind != "float" && value.kind != "number") || value.array.size() != 1) malformed(name + " is no number");
  return numbers_of<double>(value.array, name).at(0);
}

std::string StoredValue::text(const std::string& name) const {
  const StoredValue& value = at(name);
  std::string text = value.kind == "json" ? json_of(value) : "";
  if (text.size() < 2 || text.front() != '"' || text.back() != '"' || text.find('\\') != std::string::npos)
    malformed(name + " is no text");
  return text.substr(1, text.size() - 2);
}

std::vector<bool> StoredValue::flags(const std::string& name) const {
  const StoredValue& value = at(name);
  std::string text = value.kind == "json" ? json_of(value) : "";
  std::vector<bool> out;
  const auto take = [&](const char* word) {
    const bool is = text.starts_with(word);
    if (is) text.erase(0, std::strlen(word));
    return is;
  };
  bool good = take("[");
  while (good && !take("]")) {
    const bool yes = take("true");
    good = yes || take("false");
    out.push_back(yes);
    take(", ");
  }
  if (!good || !text.empty()) malformed(name + " is no list of true and false");
  return out;
}

void StoredValue::add_whole(const std::string& name, std::int64_t value) { add(name, of_json(std::to_string(value))); }
void StoredValue::add_real(const std::string& name, double value) {
  add(name, {"float", StoredArray::number(value), {}});
}
void StoredValue::add_text(const std::string& name, const std::string& value) { add(name, of_json('"' + value + '"')); }
void StoredValue::add_flags(const std::string& name, const std::vector<bool>& values) {
  std::string text;
  for (const bool v : values) text += (text.empty() ? "" : ", ") + std::string(v ? "true" : "false");
  add(name, of_json("[" + text + "]"));
}

template <class T>
std::vector<T> numbers_of(const StoredArray& array, const std::string& name) {
  std::vector<T> out(array.type.item ? array.bytes.size() / array.type.item : 0);
  const auto copy = [&]<class From>(From) {
    const unsigned char* p = array.bytes.data();
    for (T& x : out) {
      From value;
      std::memcpy(&value, p, sizeof value);
      if constexpr (std::is_integral_v<T>)
        if (value < 0 ? std::int64_t(value) < std::int64_t(std::numeric_limits<T>::min())
                      : std::uint64_t(value) > std::uint64_t(std::numeric_limits<T>::max()))
          malformed(name + " holds " + std::to_string(value) + ", which is no number that it can have");
      x = T(value); // NOLINT(bugprone-signed-char-misuse): of one byte it is a number, no character
      p += sizeof value;
    }
  };
  const StoredType t = array.type;
  if (t == stored_type<T>()) { // bits as they are
    if (!out.empty()) std::memcpy(out.data(), array.bytes.data(), array.bytes.size());
    return out;
  }
  if (t == StoredType{'i', 1})
    copy(std::int8_t{});
  else if (t == StoredType{'i', 2})
    copy(std::int16_t{});
  else if (t == StoredType{'i', 4})
    copy(std::int32_t{});
  else if (t == StoredType{'i', 8})
    copy(std::int64_t{});
  else if (t == StoredType{'u', 1} || t == StoredType{'b', 1})
    copy(std::uint8_t{});
  else if (t == StoredType{'u', 2})
    copy(std::uint16_t{});
  else if (t == StoredType{'u', 4})
    copy(std::uint32_t{});
  else if (t == StoredType{'u', 8})
    copy(std::uint64_t{});
  else if (t == StoredType{'f', 4} && std::is_floating_point_v<T>) {
    if constexpr (std::is_floating_point_v<T>) copy(float{});
  } else
    malformed(name + " is no array of " + (std::is_integral_v<T> ? "whole numbers" : "numbers"));
  return out;
}
template std::vector<double> numbers_of(const StoredArray&, const std::string&);
template std::vector<std::int64_t> numbers_of(const StoredArray&, const std::string&);
template std::vector<std::int32_t> numbers_of(const StoredArray&, const std::string&);
template std::vector<std::int8_t> numbers_of(const StoredArray&, const std::string&);
template std::vector<std::int16_t> numbers_of(const StoredArray&, const std::string&);
template std::vector<std::uint8_t> numbers_of(const StoredArray&, const std::string&);

void save_tree(const std::string& path, const StoredValue& tree) {
  const std::unique_ptr<GrowingFile> file = GrowingFile::whole(path);
  Blake2b digest(32);
  store(file->root().group("state"), tree, digest, "");
  file->root().set_attribute("format", StoredArray::text(format_name));
  file->root().set_attribute("version", StoredArray::of(tree_version, {2}));
  file->root().set_attribute("checksum", StoredArray::text(digest.hexdigest()));
  file->commit(true);
}

StoredValue load_tree(const std::string& path, const std::string& what, const std::string& given,
                      std::uint64_t stays_from) {
  const std::string it = what.starts_with("a ") ? "the " + what.substr(2) : what;
  const std::string remedy = what == "a checkpoint" ? "restart from an earlier checkpoint" : "write it again";
  const std::string give = "give a " + given + " file that Cairn wrote";
  const auto damaged = [&](const std::string& why) {
    return FileError(path, it + " is truncated or damaged (" + why + ")", remedy);
  };
  try {
    const Hdf5Node root = Hdf5Node::open(path);
    if (text_of(root.attribute("format")) != format_name) throw FileError(path, "this HDF5 file is not " + what, give);
    const std::optional<StoredArray> stored = root.attribute("version");
    const std::vector<std::int64_t> version =
        stored ? numbers_of<std::int64_t>(*stored, "version") : std::vector<std::int64_t>();
    if (version.size() != 2) malformed("it has no version");
    if (version[0] > tree_version[0])
      throw FileError(path,
                      it + " has format version " + std::to_string(version[0]) + "." + std::to_string(version[1]) +
                          ", this Cairn reads up to " + std::to_string(tree_version[0]),
                      "use a newer Cairn");
    Blake2b digest(32);
    Reading how{digest, version[0] == 1 && version[1] == 0, stays_from};
    StoredValue tree = read(root.child("state"), "", how);
    if (digest.hexdigest() != text_of(root.attribute("checksum")))
      throw FileError(path, it + " is damaged: its checksum does not match", remedy);
    return tree;
  } catch (const FileError& e) {
    if (e.problem == "the file is empty" || e.problem == "this is not an HDF5 file")
      throw FileError(path, "this is not " + what, give);
    if (e.problem.starts_with("the file is damaged: ")) throw damaged(e.problem.substr(21));
    if (e.problem == "the file is truncated" || dynamic_cast<const UnknownStructure*>(&e)) throw damaged(e.problem);
    throw;
  } catch (const std::invalid_argument& e) { throw damaged(e.what()); } catch (const std::bad_alloc&) {
    throw damaged("it asks for more memory than there is");
  }
}

} // namespace cairn

#include "growing_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

#include "checksums.hpp"
#include "hdf5_node.hpp"
#include "writer_lock.hpp"

namespace cairn {

namespace {

constexpr std::uint64_t spare = 256;     // where the last superblock stands that the disk itself is known to hold
constexpr std::int64_t commits_kept = 8; // replaced headers stay readable over so many commits
constexpr double sync_seconds = 10;      // after so much time, or waste, a commit waits for the disk
constexpr std::int64_t sync_bytes = 1 << 22;
const char* const checksum_name = "crc32";

std::int64_t product(const std::vector<std::int64_t>& shape) {
  std::int64_t n = 1;
  for (const std::int64_t along : shape) n *= along;
  return n;
}

} // namespace

decltype(GrowingFile::watch) GrowingFile::watch;

// ---------------------------------------------------------------- series

Series::Series(GrowingFile& file, StoredType type, std::vector<std::int64_t> row_shape, std::int64_t rows_per_chunk,
               hdf5::Attributes attributes)
    : file_(&file), type_(type), row_shape_(std::move(row_shape)), per_chunk_(rows_per_chunk),
      row_bytes_(type.item * product(row_shape_)), attributes_(std::move(attributes)) {
  if (row_bytes_ <= 0) throw std::invalid_argument("a row of a series must hold something");
}

std::int64_t Series::append(const void* values, std::int64_t n) {
  const std::int64_t first = rows_;
  const auto* from = static_cast<const unsigned char*>(values);
  for (std::int64_t done = 0; done < n;) {
    const std::int64_t inside = rows_ % per_chunk_;
    if (inside == 0) levels_[0].push_back(file_->allocate(std::size_t(per_chunk_ * row_bytes_)));
    const std::int64_t take = std::min(per_chunk_ - inside, n - done);
    const auto size = std::size_t(take * row_bytes_);
    file_->write(levels_[0].back() + std::uint64_t(inside * row_bytes_), from, size);
    checksum_ = crc32(from, size, checksum_);
    from += size;
    done += take;
    rows_ += take;
  }
  changed_ = changed_ || n > 0;
  return first;
}

void Series::cut(std::int64_t rows) {
  if (rows >= rows_) return;
  std::vector<unsigned char> kept(std::size_t(per_chunk_ * row_bytes_));
  checksum_ = 0;
  for (std::int64_t at = 0; at < rows; at += per_chunk_) {
    const auto size = std::size_t(std::min(per_chunk_, rows - at) * row_bytes_);
    const std::uint64_t from = levels_[0][std::size_t(at / per_chunk_)];
    if (::pread(file_->fd_, kept.data(), size, off_t(from)) != ssize_t(size)) file_->fail(errno ? errno : EIO);
    checksum_ = crc32(kept.data(), size, checksum_);
  }
  rows_ = rows;
  indexed_ = 0;
  changed_ = true;
  levels_[0].resize(std::size_t((rows + per_chunk_ - 1) / per_chunk_));
  levels_.resize(1);
}

std::uint64_t Series::place() {
  if (!changed_) return address_;
  const std::uint64_t root = index();
  hdf5::Attributes attributes = attributes_;
  attributes.emplace_back(checksum_name, StoredArray::number(checksum_));
  const hdf5::Bytes header = hdf5::series_header(type_, rows_, row_shape_, per_chunk_, root, attributes);
  address_ = file_->replace(address_, size_, header);
  size_ = header.size();
  changed_ = false;
  return address_;
}

// Writes the nodes over chunks that came since the last commit; full nodes are written once, for ever.
std::uint64_t Series::index() {
  const auto chunks = std::int64_t(levels_[0].size());
  if (chunks == 0) return hdf5::undefined;
  if (indexed_ == chunks) return levels_.back()[0];
  std::int64_t first = indexed_, span = per_chunk_; // first changed child, rows a child spans
  for (std::size_t level = 0; level == 0 || levels_[level].size() > 1; ++level, span *= hdf5::children) {
    if (levels_.size() == level + 1) levels_.emplace_back();
    const std::vector<std::uint64_t>& children = levels_[level];
    std::vector<std::uint64_t>& nodes = levels_[level + 1];
    const auto n = std::int64_t(children.size());
    first /= hdf5::children;
    for (std::int64_t k = first; k * hdf5::children < n; ++k) {
      const std::int64_t begin = k * hdf5::children, end = std::min(n, begin + hdf5::children);
      const std::int64_t last = end == n ? chunks * per_chunk_ : end * span;
      const hdf5::Bytes node =
          hdf5::tree_node({int(level), &children[std::size_t(begin)], end - begin, begin * span, span, last,
                           1 + int(row_shape_.size()), std::uint32_t(per_chunk_ * row_bytes_)});
      const bool known = std::size_t(k) < nodes.size();
      const std::uint64_t address = file_->replace(known ? nodes[std::size_t(k)] : hdf5::undefined, node.size(), node);
      if (known)
        nodes[std::size_t(k)] = address;
      else
        nodes.push_back(address);
    }
  }
  indexed_ = chunks;
  return levels_.back()[0];
}

// ---------------------------------------------------------------- groups

Group::Member* Group::find(const std::string& name) {
  const auto found = places_.find(name);
  return found == places_.end() ? nullptr : &members_[found->second].second;
}

Group::Member& Group::add(const std::string& name, Member member) {
  if (places_.contains(name)) throw std::invalid_argument("'" + name + "' is in this group already");
  if (name.empty() || name.find('/') != std::string::npos)
    throw std::invalid_argument("'" + name + "' cannot name a member of a group");
  places_.emplace(name, members_.size());
  changed_ = true;
  return members_.emplace_back(name, std::move(member)).second;
}

Group& Group::group(const std::string& name) {
  Member* there = find(name);
  if (!there) there = &add(name, std::make_unique<Group>(*file_));
  const auto* group = std::get_if<std::unique_ptr<Group>>(there);
  if (!group) throw std::invalid_argument("'" + name + "' is in this group already, and is no group");
  return **group;
}

void Group::array(const std::string& name, const StoredArray& value, hdf5::Attributes attributes) {
  if (places_.contains(name)) throw std::invalid_argument("'" + name + "' is in this group already");
  std::uint64_t address = hdf5::undefined;
  attributes.emplace_back(checksum_name, StoredArray::number(crc32(value.bytes.data(), value.bytes.size())));
  if (!value.bytes.empty()) {
    address = file_->allocate(value.bytes.size());
    file_->write(address, value.bytes.data(), value.bytes.size());
  }
  const hdf5::Bytes header = hdf5::dataset_header(value.type, value.shape, address, value.bytes.size(), attributes);
  add(name, file_->replace(hdf5::undefined, 0, header));
}

Series& Group::series(const std::string& name, StoredType type, std::vector<std::int64_t> row_shape,
                      std::int64_t rows_per_chunk, hdf5::Attributes attributes) {
  auto made = std::make_unique<Series>(*file_, type, std::move(row_shape), rows_per_chunk, std::move(attributes));
  return *std::get<std::unique_ptr<Series>>(add(name, std::move(made)));
}

void Group::soft_link(const std::string& name, const std::string& path) { add(name, path); }

void Group::set_attribute(const std::string& name, StoredArray value) {
  changed_ = true;
  for (auto& [known, old] : attributes_)
    if (known == name) {
      old = std::move(value);
      return;
    }
  attributes_.emplace_back(name, std::move(value));
}

const StoredArray* Group::attribute(const std::string& name) const {
  for (const auto& [known, value] : attributes_)
    if (known == name) return &value;
  return nullptr;
}

bool Group::contains(const std::string& name) const { return places_.contains(name); }

Series& Group::series_at(const std::string& name) {
  Member* there = find(name);
  auto* series = there ? std::get_if<std::unique_ptr<Series>>(there) : nullptr;
  if (!series) throw FileError(file_->path_, "it lacks the growing array " + name, "use a copy of it");
  return **series;
}

Group& Group::group_at(const std::string& name) {
  Member* there = find(name);
  auto* group = there ? std::get_if<std::unique_ptr<Group>>(there) : nullptr;
  if (!group) throw FileError(file_->path_, "it lacks the group " + name, "use a copy of it");
  return **group;
}

std::vector<std::string> Group::names() const {
  std::vector<std::string> out;
  for (const auto& [name, member] : members_) out.push_back(name);
  return out;
}

std::uint64_t Group::place() {
  std::vector<std::pair<std::string, hdf5::Target>> targets;
  targets.reserve(members_.size());
  for (auto& [name, member] : members_)
    targets.emplace_back(name, std::visit(
                                   [](auto& m) -> hdf5::Target {
                                     if constexpr (requires { m->place(); })
                                       return m->place();
                                     else
                                       return m;
                                   },
                                   member));
  if (!changed_ && targets == targets_) return address_;
  const hdf5::Bytes header = hdf5::group_header(targets, attributes_);
  address_ = file_->replace(address_, size_, header);
  size_ = header.size();
  targets_ = std::move(targets);
  changed_ = false;
  return address_;
}

// Members of a group that is read, as they stand, to be appended to.
void Group::take_over(const Hdf5Node& old, int depth) {
  if (depth > 64) throw FileError(file_->path_, "its groups are nested without end", "use a copy of it");
  for (const std::string& name : old.attribute_names())
    if (std::optional<StoredArray> value = old.attribute(name)) set_attribute(name, *value);
  for (const std::string& name : old.names()) {
    if (const std::optional<std::string> path = old.soft_link(name)) {
      add(name, *path);
      continue;
    }
    const Hdf5Node member = old.child(name);
    if (member.is_group()) {
      auto made = std::make_unique<Group>(*file_);
      made->take_over(member, depth + 1);
      add(name, std::move(made));
    } else if (!member.is_chunked()) {
      add(name, member.address());
    } else {
      hdf5::Attributes attributes;
      std::optional<StoredArray> checksum;
      for (const std::string& a : member.attribute_names())
        if (a == checksum_name)
          checksum = member.attribute(a);
        else if (std::optional<StoredArray> value = member.attribute(a))
          attributes.emplace_back(a, *value);
      const std::vector<std::int64_t>& shape = member.shape();
      if (shape.empty())
        throw FileError(file_->path_, "an array that grows has no axis", "copy it again from where it was made");
      auto made = std::make_unique<Series>(*file_, member.type(), std::vector(shape.begin() + 1, shape.end()),
                                           member.chunk_rows(), std::move(attributes));
      made->levels_[0] = member.chunk_addresses();
      made->rows_ = shape[0];
      if (checksum && checksum->type == StoredType{'u', 4} && checksum->bytes.size() == 4)
        std::memcpy(&made->checksum_, checksum->bytes.data(), 4);
      else // a file from before there were checksums
        made->checksum_ = member.data_checksum();
      add(name, std::move(made));
    }
  }
}

// ---------------------------------------------------------------- the file

GrowingFile::GrowingFile(std::string path, If mode) : path_(std::move(path)) {
  if (mode == If::go_on) {
    reopen();
    return;
  }
  part_ = path_ + ".part";
  if (is_folder(path_)) throw FileError(path_, "this is a folder", "give the name of a file");
  if (exists(path_) && mode != If::replace)
    throw FileError(path_, "this file exists already",
                    "choose another name, or ask for it to be overwritten (overwrite=True, --overwrite), or for a run "
                    "to go on in it (append=True, --append)");
  fd_ = create_part(part_, path_);
  try {
    if (exists(path_)) {
      if (mode != If::replace) // another run was renamed to it meanwhile
        throw FileError(path_, "another run has written this file meanwhile", "choose another name");
      refuse_if_written(path_);
    }
  } catch (...) {
    abandon();
    throw;
  }
  root_ = std::make_unique<Group>(*this);
}

std::unique_ptr<GrowingFile> GrowingFile::whole(std::string path) {
  if (is_folder(path)) throw FileError(path, "this is a folder", "give the name of a file");
  std::unique_ptr<GrowingFile> file(new GrowingFile);
  file->path_ = std::move(path);
  file->whole_ = true;
  std::tie(file->fd_, file->part_) = create_part_beside(file->path_);
  file->root_ = std::make_unique<Group>(*file);
  return file;
}

GrowingFile::~GrowingFile() {
  abandon(); // discards rows that were not committed
}

void GrowingFile::abandon() {
  if (fd_ < 0) return;
  if (!part_.empty() && stands(fd_, part_)) ::unlink(part_.c_str());
  part_.clear();
  ::close(fd_);
  fd_ = -1;
}

void GrowingFile::reopen() {
  try {
    fd_ = ::open(path_.c_str(), O_RDWR | O_CLOEXEC);
    if (fd_ < 0) throw system_error(path_, errno);
    if (lock_for_writing(fd_) == Lock::held_by_another) throw being_written(path_);
    hdf5::Bytes block(hdf5::superblock_size);
    const bool read = ::pread(fd_, block.data(), block.size(), 0) == ssize_t(block.size());
    std::uint64_t root = 0;
    std::memcpy(&end_, block.data() + 28, 8);
    std::memcpy(&root, block.data() + 36, 8);
    if (!read || block != hdf5::superblock(root, end_))
      throw FileError(path_, "this file was not written by a simulation", "give the file of a run, or another name");
    root_ = std::make_unique<Group>(*this);
    const Hdf5Node old = Hdf5Node::open(path_);
    root_->take_over(old, 0);
    end_ = (end_ + 7) / 8 * 8;
  } catch (const std::exception& e) {
    if (fd_ >= 0) ::close(fd_);
    fd_ = -1;
    if (dynamic_cast<const FileError*>(&e)) throw;
    throw FileError(path_, std::string("the file is damaged: ") + e.what(), "use a copy of it");
  }
}

void GrowingFile::commit(std::optional<bool> sync) {
  const std::chrono::duration<double> unsynced = std::chrono::steady_clock::now() - synced_at_;
  const bool synced = sync.value_or(unsynced.count() > sync_seconds || wasted_ > sync_bytes);
  const std::uint64_t root = root_->place(); // writes, and the file ends later
  const hdf5::Bytes block = hdf5::superblock(root, end_);
  if (failure_) throw FileError(*failure_);
  if (!stands(fd_, part_.empty() ? path_ : part_)) {
    failure_ = std::make_unique<FileError>(
        path_, "the file, or its folder, was removed or replaced while it was written: what was written is lost",
        "leave the folder alone while a run writes to it");
    throw FileError(*failure_);
  }
  struct stat now {};
  if (::fstat(fd_, &now) != 0) fail(errno);
  if (std::uint64_t(now.st_size) < end_ && ::ftruncate(fd_, off_t(end_)) != 0) fail(errno);
  if (synced && !whole_ && ::fsync(fd_) != 0) fail(errno);
  write(0, block.data(), block.size());
  if (synced) {
    write(spare, block.data(), block.size());
    if (::fsync(fd_) != 0) fail(errno);
  }
  if (!part_.empty()) {
    if (::rename(part_.c_str(), path_.c_str()) != 0) fail(errno);
    part_.clear();
    if (whole_) sync_folder_of(path_);
  }
  ++commits_;
  if (synced) {
    durable_ = commits_;
    wasted_ = 0;
    synced_at_ = std::chrono::steady_clock::now();
  }
}

void GrowingFile::close() {
  if (fd_ < 0) return;
  try {
    if (!failure_) commit(true);
  } catch (...) {
    abandon();
    throw;
  }
  abandon();
}

void GrowingFile::fail(int number) {
  failure_ = std::make_unique<FileError>(system_error(path_, number));
  throw FileError(*failure_);
}

void GrowingFile::write(std::uint64_t address, const void* data, std::size_t size) {
  if (failure_) throw FileError(*failure_);
  if (fd_ < 0) throw FileError(path_, "the file is closed", "open a new one");
  const auto* from = static_cast<const unsigned char*>(data);
  if (watch)
    if (const int number = watch(address, {from, size})) fail(number);
  while (size > 0) {
    const ssize_t done = ::pwrite(fd_, from, size, off_t(address));
    if (done < 0) {
      if (errno == EINTR) continue;
      fail(errno);
    }
    from += done;
    address += std::uint64_t(done);
    size -= std::size_t(done);
  }
}

std::uint64_t GrowingFile::allocate(std::size_t size) {
  const std::uint64_t address = end_;
  end_ += (size + 7) / 8 * 8;
  return address;
}

std::uint64_t GrowingFile::replace(std::uint64_t old, std::size_t old_size, const hdf5::Bytes& data) {
  if (old != hdf5::undefined) {
    freed_[old_size].emplace_back(commits_, old);
    wasted_ += std::int64_t(old_size);
  }
  const auto room = freed_.find(data.size());
  // what the last durable superblock refers to must stay, lest a loss of power brings it back
  const bool free = room != freed_.end() && !room->second.empty() &&
                    room->second.front().first < std::min(commits_ - commits_kept, durable_);
  std::uint64_t address;
  if (free) {
    address = room->second.front().second;
    room->second.pop_front();
  } else {
    address = allocate(data.size());
  }
  write(address, data.data(), data.size());
  return address;
}

bool restore_superblock(const std::string& path) {
  const int fd = ::open(path.c_str(), O_RDWR | O_CLOEXEC);
  if (fd < 0) throw system_error(path, errno);
  const std::unique_ptr<const int, void (*)(const int*)> closed(&fd, [](const int* d) { ::close(*d); });
  hdf5::Bytes first(hdf5::superblock_size), kept(hdf5::superblock_size);
  const auto size = std::uint64_t(std::max<off_t>(::lseek(fd, 0, SEEK_END), 0));
  const bool read = ::pread(fd, first.data(), first.size(), 0) == ssize_t(first.size()) &&
                    ::pread(fd, kept.data(), kept.size(), spare) == ssize_t(kept.size());
  std::uint64_t end = 0, root = 0;
  std::memcpy(&end, kept.data() + 28, 8);
  std::memcpy(&root, kept.data() + 36, 8);
  if (!read || kept != hdf5::superblock(root, end) || end > size)
    throw FileError(path, "there is no earlier state in this file to go back to", "use a copy of it");
  if (kept == first) return false;
  if (::pwrite(fd, kept.data(), kept.size(), 0) != ssize_t(kept.size())) throw system_error(path, errno);
  return true;
}

} // namespace cairn

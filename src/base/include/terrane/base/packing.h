#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "terrane/base/result.h"

/// Values as bytes, for another memory that this same program runs in (a Web Worker's): as they lie in
/// memory, one after the other. Not a format: nothing of it is kept, or comes from elsewhere.
namespace terrane {

/// What a memory at the other end still has of the objects that were sent there: the last so many. Each is
/// sent whole once, and then named by its place.
class SentObjects {
 public:
  static constexpr uint32_t kMost = 24;
  struct Place {
    uint32_t slot = kMost;  ///< kMost: the other end keeps nothing
    bool isThere = false;
  };
  /// Where an object is or, if it is not there, comes to be: in place of the one not sent for longest.
  Place of(const std::shared_ptr<const void>& object) {
    uint32_t oldest = 0;
    for (uint32_t slot = 0; slot < kMost; ++slot) {
      if (slots_[slot].address == object.get() && !slots_[slot].object.expired()) {
        slots_[slot].used = ++uses_;
        return {slot, true};
      }
      if (slots_[slot].used < slots_[oldest].used) oldest = slot;
    }
    slots_[oldest] = {object.get(), object, ++uses_};
    return {oldest, false};
  }

 private:
  struct Slot {
    const void* address = nullptr;
    std::weak_ptr<const void> object;  ///< note: another object may come to lie where an old one lay
    uint64_t used = 0;
  };
  std::array<Slot, kMost> slots_;
  uint64_t uses_ = 0;
};

/// The other end of SentObjects.
class KeptObjects {
 public:
  template <class T>
  std::shared_ptr<const T> find(uint32_t slot) const {
    if (slot >= slots_.size() || slots_[slot].type != &kType<T>) return nullptr;
    return std::static_pointer_cast<const T>(slots_[slot].object);
  }
  template <class T>
  void keep(uint32_t slot, std::shared_ptr<const T> object) {
    if (slot < slots_.size()) slots_[slot] = {std::move(object), &kType<T>};
  }

 private:
  template <class T>
  static constexpr char kType = 0;
  struct Slot {
    std::shared_ptr<const void> object;
    const char* type = nullptr;
  };
  std::array<Slot, SentObjects::kMost> slots_;
};

/// Writes values one after the other.
class Packer {
 public:
  template <class T>
  void value(const T& value) {
    static_assert(std::is_trivially_copyable_v<T> && !std::is_pointer_v<T>);
    append(&value, sizeof(T));
  }
  /// So many elements, as `Unpacker::elements()` reads them: it has to know how many.
  template <class T>
  void elements(const T* first, size_t count) {
    static_assert(std::is_trivially_copyable_v<T> && !std::is_pointer_v<T>);
    append(first, count * sizeof(T));
  }
  template <class T>
  void array(const std::vector<T>& values) {
    value(static_cast<uint64_t>(values.size()));
    elements(values.data(), values.size());
  }
  void text(const std::string& words) {
    value(static_cast<uint64_t>(words.size()));
    elements(words.data(), words.size());
  }
  /// Objects that `receiver` has already are named only. It must outlive the packing.
  void sendTo(SentObjects* receiver) { receiver_ = receiver; }
  /// `packValue(packer, object)`, unless the receiver has it.
  template <class T, class PackValue>
  void object(const std::shared_ptr<const T>& object, const PackValue& packValue) {
    const SentObjects::Place place = receiver_ != nullptr ? receiver_->of(object) : SentObjects::Place{};
    value(place.slot);
    value(static_cast<uint8_t>(place.isThere ? 1 : 0));
    if (!place.isThere) packValue(*this, *object);
  }
  void reserve(size_t bytes) { bytes_.reserve(bytes_.size() + bytes); }
  const std::vector<uint8_t>& bytes() const { return bytes_; }
  std::vector<uint8_t> take() { return std::move(bytes_); }
  /// Begins anew, in the same memory.
  void clear() { bytes_.clear(); }

 private:
  void append(const void* from, size_t size) {
    const auto* bytes = static_cast<const uint8_t*>(from);
    bytes_.insert(bytes_.end(), bytes, bytes + size);
  }
  std::vector<uint8_t> bytes_;
  SentObjects* receiver_ = nullptr;
};

/// Reads what a Packer wrote. Where bytes are missing, or a size is not what it must be, it gives zeros and
/// nothing from then on, and status() says why: never reads beyond the bytes, allocates no more than they
/// are.
class Unpacker {
 public:
  /// `kept`: where objects stay that may be named again; null: nowhere.
  explicit Unpacker(std::span<const uint8_t> bytes, KeptObjects* kept = nullptr)
      : bytes_(bytes), kept_(kept) {}

  template <class T>
  T value() {
    static_assert(std::is_trivially_copyable_v<T> && !std::is_pointer_v<T>);
    T out{};
    if (has(1, sizeof(T))) read(&out, sizeof(T));
    return out;
  }
  template <class T>
  void elements(T* first, size_t count) {
    static_assert(std::is_trivially_copyable_v<T> && !std::is_pointer_v<T>);
    if (has(count, sizeof(T))) read(first, count * sizeof(T));
  }
  template <class T>
  std::vector<T> array() {
    static_assert(std::is_trivially_copyable_v<T> && !std::is_pointer_v<T>);
    const auto count = value<uint64_t>();
    if (!has(count, sizeof(T))) return {};
    std::vector<T> out(static_cast<size_t>(count));
    read(out.data(), out.size() * sizeof(T));
    return out;
  }
  /// An array of exactly so many elements.
  template <class T>
  std::vector<T> array(size_t count) {
    std::vector<T> out = array<T>();
    require(out.size() == count, "an array of another size");
    return out;
  }
  /// What Packer::object() wrote: `unpackValue(unpacker)`, or what is kept. Never null.
  template <class T, class UnpackValue>
  std::shared_ptr<const T> object(const UnpackValue& unpackValue) {
    const auto slot = value<uint32_t>();
    std::shared_ptr<const T> out;
    if (value<uint8_t>() != 0) {
      if (kept_ != nullptr) out = kept_->template find<T>(slot);
      require(out != nullptr, "an object that is not here");
    } else {
      out = std::make_shared<const T>(unpackValue(*this));
      if (ok() && kept_ != nullptr) kept_->keep(slot, out);
    }
    return ok() ? out : std::make_shared<const T>();
  }
  std::string text() {
    const std::vector<char> words = array<char>();
    return {words.begin(), words.end()};
  }
  /// What was read holds together; else nothing more is read.
  void require(bool holds, const char* whatIsWrong) {
    if (!holds && wrong_ == nullptr) wrong_ = whatIsWrong;
  }

  bool ok() const { return wrong_ == nullptr; }
  /// Were all bytes read, and no more? The error says where it went wrong.
  Status status() const {
    if (wrong_ != nullptr) return makeError("packed bytes: {} at byte {} of {}", wrong_, at_, bytes_.size());
    if (at_ != bytes_.size())
      return makeError("packed bytes: {} of {} are left over", bytes_.size() - at_, bytes_.size());
    return {};
  }

 private:
  bool has(uint64_t count, size_t size) {
    require(count <= (bytes_.size() - at_) / size, "too few of them");
    return ok();
  }
  void read(void* to, size_t size) {
    if (size > 0) std::memcpy(to, bytes_.data() + at_, size);
    at_ += size;
  }
  std::span<const uint8_t> bytes_;
  size_t at_ = 0;
  const char* wrong_ = nullptr;
  KeptObjects* kept_ = nullptr;
};

/// A result: its value by `packValue(packer, value)`, or the error's words.
template <class T, class PackValue>
void packResult(Packer& packer, const Result<T>& result, const PackValue& packValue) {
  packer.value(static_cast<uint8_t>(result.ok() ? 1 : 0));
  if (result.ok())
    packValue(packer, *result);
  else
    packer.text(result.error().message);
}
template <class T, class UnpackValue>
Result<T> unpackResult(Unpacker& unpacker, const UnpackValue& unpackValue) {
  if (unpacker.value<uint8_t>() != 0) return unpackValue(unpacker);
  return Error{unpacker.text()};
}

}  // namespace terrane

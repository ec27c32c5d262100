#pragma once

#include <algorithm>
#include <cstddef>
#include <initializer_list>
#include <memory>
#include <span>
#include <utility>
#include <vector>

/// Flat arrays that never change: the elements of a vector, or those that lie in a mapped file.
namespace its {

/// A read-only array. Copies are shallow: they share the elements and what keeps these alive. Converts to
/// std::span<const T>. Reading is as fast as from a vector.
template <class T>
class Array {
public:
    // NOLINTBEGIN(readability-identifier-naming): names of the standard
    using value_type = T;
    using const_iterator = const T*;
    using iterator = const_iterator;
    // NOLINTEND(readability-identifier-naming)

    Array() = default;
    Array(std::vector<T>&& elements) {
        const auto owned = std::make_shared<const std::vector<T>>(std::move(elements));
        data_ = owned->data();
        size_ = owned->size();
        owner_ = owned;
    }
    Array(std::initializer_list<T> elements) : Array(std::vector<T>(elements)) {}
    /// Elements that lie elsewhere and live as long as `owner`.
    Array(std::span<const T> elements, std::shared_ptr<const void> owner)
        : data_(elements.data()), size_(elements.size()), owner_(std::move(owner)) {}

    const T& operator[](std::size_t i) const { return data_[i]; }
    const T& front() const { return data_[0]; }
    const T& back() const { return data_[size_ - 1]; }
    const T* data() const { return data_; }
    const T* begin() const { return data_; }
    const T* end() const { return data_ + size_; }
    std::size_t size() const { return size_; }
    bool empty() const { return size_ == 0; }

    friend bool operator==(const Array& a, const Array& b) { return std::ranges::equal(a, b); }
    friend bool operator==(const Array& a, const std::vector<T>& b) { return std::ranges::equal(a, b); }

private:
    const T* data_ = nullptr;
    std::size_t size_ = 0;
    std::shared_ptr<const void> owner_;
};

}  // namespace its

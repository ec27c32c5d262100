#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "formats/archive.h"

namespace its::formats {

/// What slicers write into a 3MF file about parts that are not solids: modifiers, negative volumes, support
/// blockers and enforcers. To 3MF itself all are meshes like any other. PrusaSlicer and its kin name ranges of
/// an object's triangles (volume_type in Metadata/…model.config), Orca and Bambu Studio an object's components
/// (subtype in Metadata/model_settings.config).
class SlicerParts {
public:
    /// \throws InputError on damaged XML
    explicit SlicerParts(const std::vector<ArchiveFile>& files);

    /// Whether a component of an object is no solid.
    bool leaves_out(std::int64_t object, std::int64_t component);
    /// How many parts of an object are no solids.
    std::size_t count(std::int64_t object) const { return first_of(object + 1) - first_of(object); }
    /// Calls fn(first, end) for the ranges of an object's `triangles` triangles that are solids.
    template <class F>
    void for_solid_triangles(std::int64_t object, std::uint64_t triangles, F&& fn) {
        std::uint64_t begin = 0;
        for (std::size_t i = first_of(object); i < parts_.size() && parts_[i].object == object; ++i) {
            Part& part = parts_[i];
            if (part.component >= 0 || part.first >= triangles) break;  // by their order
            part.used = true;
            if (part.first > begin) fn(begin, part.first);
            begin = std::max(begin, part.end);
        }
        if (begin < triangles) fn(begin, triangles);
    }
    /// A line for each part that was left out.
    std::vector<std::string> lines() const;

private:
    struct Part {
        std::int64_t object = -1, component = -1;  ///< no component: a range of triangles
        std::uint64_t first = 0, end = 0;
        std::string_view kind;
        const ArchiveFile* file = nullptr;
        bool used = false;
    };

    void read(const ArchiveFile& file);
    std::size_t first_of(std::int64_t object) const;

    std::vector<Part> parts_;  ///< those that are no solids, by object, component and first triangle
};

}  // namespace its::formats

#pragma once

#include <memory>
#include <vector>

#include "its/mesh.h"

/// Other libraries' closest points, behind one interface.
namespace its::bench {

class PeerIndex {
public:
    virtual ~PeerIndex() = default;
    virtual double distance(const Vec3& p) const = 0;
};

struct PeerClosestPoint {
    const char* name;
    std::shared_ptr<PeerIndex> (*make)(const Mesh&);
};

std::vector<PeerClosestPoint> closest_point_peers();

}  // namespace its::bench

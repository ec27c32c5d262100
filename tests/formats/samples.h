#pragma once

#include <unistd.h>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

/// Files made byte by byte, for tests of the readers.
namespace its::samples {

/// A folder of its own for a test; removed with its contents.
class TemporaryFolder {
public:
    TemporaryFolder() {
        std::string name = (std::filesystem::temp_directory_path() / "its-mesh-XXXXXX").string();
        if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
        path_ = name;
    }
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
    ~TemporaryFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
    const std::filesystem::path& path() const { return path_; }

private:
    std::filesystem::path path_;
};

inline void write_file(const std::filesystem::path& path, const std::string& bytes) {
    std::ofstream(path, std::ios::binary).write(bytes.data(), std::streamsize(bytes.size()));
}

inline std::string read_file(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

/// The bytes of a number as on this machine: little-endian.
template <class T>
std::string raw(T value) {
    std::string bytes(sizeof(T), '\0');
    std::memcpy(bytes.data(), &value, sizeof(T));
    return bytes;
}

template <class T>
std::string raw(const std::vector<T>& values) {
    std::string bytes;
    for (const T value : values) bytes += raw(value);
    return bytes;
}

inline std::string glb(std::string json, std::string data) {
    json.resize((json.size() + 3) / 4 * 4, ' ');
    data.resize((data.size() + 3) / 4 * 4, '\0');
    const auto size = std::uint32_t(28 + json.size() + data.size());
    return "glTF" + raw(std::uint32_t{2}) + raw(size) + raw(std::uint32_t(json.size())) + "JSON" + json +
           raw(std::uint32_t(data.size())) + std::string("BIN\0", 4) + data;
}

inline std::uint32_t crc32(const std::string& bytes) {
    std::uint32_t crc = 0xffffffff;
    for (const char c : bytes) {
        crc ^= static_cast<unsigned char>(c);
        for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ ((crc & 1) != 0 ? 0xedb88320u : 0u);
    }
    return ~crc;
}

/// An archive of uncompressed files.
inline std::string zip(const std::vector<std::pair<std::string, std::string>>& files) {
    std::string archive, contents;
    for (const auto& [name, bytes] : files) {
        const std::string common = raw(std::uint16_t{20}) + raw(std::uint32_t{0}) +
                                   raw(std::uint32_t{0x50210000}) + raw(crc32(bytes)) +
                                   raw(std::uint32_t(bytes.size())) + raw(std::uint32_t(bytes.size())) +
                                   raw(std::uint16_t(name.size())) + raw(std::uint16_t{0});
        contents += "PK\1\2" + raw(std::uint16_t{20}) + common + std::string(10, '\0') +
                    raw(std::uint32_t(archive.size())) + name;
        archive += "PK\3\4" + common + name + bytes;
    }
    return archive + contents + "PK\5\6" + raw(std::uint32_t{0}) + raw(std::uint16_t(files.size())) +
           raw(std::uint16_t(files.size())) + raw(std::uint32_t(contents.size())) +
           raw(std::uint32_t(archive.size())) + raw(std::uint16_t{0});
}

/// A 3MF file with these resources and build items (XML).
inline std::string threemf(const std::string& resources, const std::string& build) {
    const std::string xml = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>";
    return zip(
        {{"[Content_Types].xml",
          xml + "<Types xmlns=\"http://schemas.openxmlformats.org/package/2006/content-types\">"
                "<Default Extension=\"rels\" "
                "ContentType=\"application/vnd.openxmlformats-package.relationships+xml\"/><Default "
                "Extension=\"model\" ContentType=\"application/vnd.ms-package.3dmanufacturing-3dmodel+xml\"/>"
                "</Types>"},
         {"_rels/.rels",
          xml + "<Relationships xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\">"
                "<Relationship Target=\"/3D/3dmodel.model\" Id=\"rel0\" "
                "Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/></Relationships>"},
         {"3D/3dmodel.model",
          xml +
              "<model unit=\"millimeter\" xml:lang=\"en-US\" "
              "xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\"><resources>" +
              resources + "</resources><build>" + build + "</build></model>"}});
}

/// All small files that fuzzing starts from.
std::vector<std::filesystem::path> seeds();

}  // namespace its::samples

// A client with roscpp: calls services and listens to topics, of every type that "interface.inc" names.
//
// Reads a command a line, and prints a line for each. Requests, answers and messages are bytes in hexadecimal; they
// go through the generated classes, field by field.
//
//   types                    service and topic types, each with its md5; then "end"
//   call TYPE PATH REQUEST   "answered BYTES", or "failed"
//   listen TYPE TOPIC        "listening"
//   heard                    a line "TOPIC BYTES" for the first message of each topic; then "end"

#include <ros/console.h>
#include <ros/ros.h>

#include <cstdint>
#include <functional>
#include <iomanip>
#include <iostream>
#include <map>
#include <mutex>
#include <sstream>
#include <string>
#include <vector>

// Generated: includes of all types, SERVICE(package, name) for each service type, and TOPIC(package, name).
#include "interface.inc"

namespace {

const ros::Duration DEADLINE(20.0);  // of a service that is not there yet

struct ServiceKind {
  std::string md5;
  std::function<std::string(const std::string &path, const std::string &request)> call;
};

struct TopicKind {
  std::string md5;
  std::function<ros::Subscriber(ros::NodeHandle &node, const std::string &topic)> listen;
};

std::mutex mutex;
std::map<std::string, std::string> first_messages;

template <class Message> std::string to_hex(const Message &message) {
  std::vector<uint8_t> bytes(ros::serialization::serializationLength(message));
  ros::serialization::OStream stream(bytes.data(), bytes.size());
  ros::serialization::serialize(stream, message);
  std::ostringstream text;
  text << std::hex << std::setfill('0');
  for (const uint8_t byte : bytes)
    text << std::setw(2) << static_cast<int>(byte);
  return text.str();
}

template <class Message> void from_hex(const std::string &text, Message &message) {
  std::vector<uint8_t> bytes;
  for (size_t place = 0; place + 1 < text.size(); place += 2)
    bytes.push_back(static_cast<uint8_t>(std::stoi(text.substr(place, 2), nullptr, 16)));
  ros::serialization::IStream stream(bytes.data(), bytes.size());
  ros::serialization::deserialize(stream, message);
}

template <class Service> ServiceKind service_kind() {
  const auto call = [](const std::string &path, const std::string &request) -> std::string {
    Service service;
    from_hex(request, service.request);
    if (!ros::service::waitForService(path, DEADLINE) || !ros::service::call(path, service))
      return "failed";
    return "answered " + to_hex(service.response);
  };
  return {ros::service_traits::md5sum<Service>(), call};
}

template <class Message> TopicKind topic_kind() {
  const auto listen = [](ros::NodeHandle &node, const std::string &topic) {
    const boost::function<void(const boost::shared_ptr<const Message> &)> keep =
      [topic](const boost::shared_ptr<const Message> &message) {
        const std::lock_guard<std::mutex> lock(mutex);
        first_messages.emplace(topic, to_hex(*message));
      };
    return node.subscribe<Message>(topic, 10, keep);
  };
  return {ros::message_traits::md5sum<Message>(), listen};
}

const std::map<std::string, ServiceKind> SERVICES = {
#define SERVICE(package, name) {#package "/" #name, service_kind<package::name>()},
#define TOPIC(package, name)
  ALL_TYPES
#undef SERVICE
#undef TOPIC
};

const std::map<std::string, TopicKind> TOPICS = {
#define SERVICE(package, name)
#define TOPIC(package, name) {#package "/" #name, topic_kind<package::name>()},
  ALL_TYPES
#undef SERVICE
#undef TOPIC
};

}  // namespace

int main(int argc, char **argv) {
  ros::init(argc, argv, "roscpp_client", ros::init_options::AnonymousName | ros::init_options::NoSigintHandler);
  // Messages below this level go to the standard output, which has the answers.
  ros::console::set_logger_level(ROSCONSOLE_ROOT_LOGGER_NAME, ros::console::levels::Error);
  ros::console::notifyLoggerLevelsChanged();
  ros::NodeHandle node;
  ros::AsyncSpinner spinner(1);
  spinner.start();
  std::vector<ros::Subscriber> subscribers;
  for (std::string line; std::getline(std::cin, line);) {
    std::istringstream words(line);
    std::string command, type, name, request;
    words >> command >> type >> name >> request;
    if (command == "types") {
      for (const auto &kind : SERVICES)
        std::cout << kind.first << ' ' << kind.second.md5 << '\n';
      for (const auto &kind : TOPICS)
        std::cout << kind.first << ' ' << kind.second.md5 << '\n';
      std::cout << "end" << std::endl;
    } else if (command == "call") {
      std::cout << SERVICES.at(type).call(name, request) << std::endl;
    } else if (command == "listen") {
      subscribers.push_back(TOPICS.at(type).listen(node, name));
      std::cout << "listening" << std::endl;
    } else if (command == "heard") {
      const std::lock_guard<std::mutex> lock(mutex);
      for (const auto &message : first_messages)
        std::cout << message.first << ' ' << message.second << '\n';
      std::cout << "end" << std::endl;
    }
  }
  return 0;
}

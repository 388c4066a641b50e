"""The table of facades: for each service and topic of a robot, the member of a Python class that uses it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from palaestra_sim.scene.devices import DEVICES
from tools.interface.everything import device_name

# Paths without a member of a class: only ROS's own tools need them, or another path does the same.
WITHOUT: Final = frozenset(
    (
        *("get_loggers", "set_logger_level", "/rosout", "/model_name", "/clock"),
        *("robot/get_data", "robot/set_data"),  # the older names of get_custom_data and set_custom_data
        "supervisor/simulation_revert",  # the older name of world_reload
        "supervisor/field/remove_node",  # field/remove removes nodes too
        "lidar/laser_scan/layer0",  # the older name of laser_scan, which Webots no longer has
    )
)
_NAME: Final = "get_name"  # returns a device's name, which a facade already has when it is created

# The class of each type of device whose class has another name.
_CLASSES: Final = {
    "RotationalMotor": "JointMotor",
    "LinearMotor": "JointMotor",
    "battery_sensor": "BatterySensor",
    "keyboard": "Keyboard",
    "joystick": "Joystick",
}
# The members that every class has, by the last part of the path.
_COMMON: Final = {
    "get_model": "model",
    "get_node_type": "node_type",
    "enable": "enable",
    "get_sampling_period": "sampling_period_ms",
    "value": "value",
    "values": "value",
    "get_lookup_table": "lookup_table",
    "get_brake_name": "brake_name",
    "get_motor_name": "motor_name",
    "get_position_sensor_name": "position_sensor_name",
    "get_type": "slides",
}
_TYPES: Final = ("bool", "int32", "float", "vec2f", "vec3f", "rotation", "color", "string")
_SHAPES: Final = ("pixel", "line", "rectangle", "oval", "polygon", "text")
_VERBS: Final = {"get": "get_field", "set": "set_field", "insert": "insert_value"}

_ROBOT: Final = {
    "time_step": "Stepper.step",
    "get_mode": "RobotController.control_mode",
    "get_supervisor": "RobotController.supervises",
    "get_synchronization": "RobotController.synchronizes",
    "get_model": "RobotController.model",
    "get_project_path": "RobotController.project_path",
    "get_world_path": "Observer.world_path",
    "get_basic_time_step": "Observer.basic_time_step_ms",
    "get_number_of_devices": "Observer.number_of_devices",
    "wait_for_user_input_event": "RobotController.wait_for_input",
    "get_time": "Observer.time",
    "get_urdf": "RobotController.urdf",
    "get_custom_data": "RobotController.custom_data",
    "set_custom_data": "RobotController.set_custom_data",
    "set_mode": "RobotController.set_control_mode",
    "wwi_send_text": "RobotController.send_to_window",
    "wwi_receive_text": "RobotController.receive_from_window",
    "get_device_list": "Observer.devices",
}
_OURS: Final = {
    "window/send_text": "RobotController.send_as_window",
    "scene": "Observer.scene",
    "scene_state": "Observer.scene_state",
    "keyboard/press": "Keyboard.press",
    "keyboard/release": "Keyboard.release",
    "joystick/press": "Joystick.press",
    "joystick/release": "Joystick.release",
    "joystick/set_axes": "Joystick.move",
    "joystick/set_povs": "Joystick.move",
}
_SUPERVISOR: Final = {
    "simulation_quit": "Supervisor.quit",
    "simulation_reset": "Supervisor.reset",
    "simulation_reset_physics": "Supervisor.reset_physics",
    "simulation_get_mode": "Observer.mode",
    "simulation_set_mode": "Supervisor.set_mode",
    "world_load": "Supervisor.load_world",
    "world_save": "Supervisor.save_world",
    "world_reload": "Supervisor.reload",
    "export_image": "Supervisor.save_image",
    "animation_start_recording": "Supervisor.start_animation",
    "animation_stop_recording": "Supervisor.stop_animation",
    "movie_start_recording": "Supervisor.start_movie",
    "movie_stop_recording": "Supervisor.stop_movie",
    "movie_failed": "Supervisor.movie_failed",
    "movie_is_ready": "Supervisor.movie_is_ready",
    "set_label": "Supervisor.set_label",
    "virtual_reality_headset_is_used": "Observer.headset_pose",
    "virtual_reality_headset_get_position": "Observer.headset_pose",
    "virtual_reality_headset_get_orientation": "Observer.headset_pose",
    "get_root": "Observer.find",
    "get_self": "Observer.own_node",
    "get_selected": "Observer.selected",
    "get_from_def": "Observer.find",
    "get_from_id": "Observer.with_id",
    "get_from_device": "Observer.find_device",
}
_NODE: Final = {
    "get_id": "WorldNode.id",
    "get_type": "WorldNode.type_number",
    "get_type_name": "WorldNode.type_name",
    "get_def": "WorldNode.definition",
    "get_base_type_name": "WorldNode.base_type_name",
    "get_parent_node": "WorldNode.parent",
    "is_proto": "WorldNode.is_proto",
    "get_field": "WorldNode.value",
    "get_field_by_index": "WorldNode.fields",
    "get_number_of_fields": "WorldNode.fields",
    "export_string": "WorldNode.text",
    "get_position": "WorldNode.pose",
    "get_orientation": "WorldNode.pose",
    "get_pose": "WorldNode.pose_in",
    "enable_pose_tracking": "WorldNode.track_pose",
    "disable_pose_tracking": "WorldNode.track_pose",
    "get_velocity": "Supervisor.velocity",
    "get_center_of_mass": "Observer.center_of_mass",
    "get_static_balance": "Observer.is_balanced",
    "get_contact_points": "WorldNode.contact_points",
    "enable_contact_points_tracking": "WorldNode.track_contacts",
    "disable_contact_points_tracking": "WorldNode.track_contacts",
    "set_velocity": "Supervisor.set_velocity",
    "add_force": "Supervisor.add_force",
    "add_force_with_offset": "Supervisor.add_force",
    "add_torque": "Supervisor.add_torque",
    "move_viewpoint": "Supervisor.look_at",
    "set_visibility": "Supervisor.set_visible",
    "remove": "Supervisor.remove_node",
    "reset_physics": "Supervisor.stop_inertia",
    "restart_controller": "Supervisor.restart_controller",
    "save_state": "Supervisor.save_state",
    "load_state": "Supervisor.load_state",
    "set_joint_position": "Supervisor.set_joint",
}
_FIELD: Final = {
    "get_name": "WorldNode.fields",
    "get_type": "WorldNode.value",
    "get_type_name": "WorldNode.fields",
    "get_count": "Observer.length",
    "get_node": "WorldNode.nodes",
    "remove": "Supervisor.remove_value",
    "import_node_from_string": "Supervisor.insert_node",
    "enable_sf_tracking": "Supervisor.track_field",
    "disable_sf_tracking": "Supervisor.track_field",
    **{f"{verb}_{kind}": f"Supervisor.{member}" for verb, member in _VERBS.items() for kind in _TYPES},
}


def _motor(effort: str) -> Mapping[str, str]:
    """Return the members for the paths of a motor; `effort` is "torque" or "force"."""
    return {
        **dict.fromkeys(("set_position", "set_velocity", f"set_{effort}"), "JointMotor.set"),
        "set_acceleration": "JointMotor.set_acceleration",
        "set_control_pid": "JointMotor.set_gains",
        "get_target_position": "JointMotor.target_position",
        "get_velocity": "JointMotor.target_velocity",
        "get_acceleration": "JointMotor.acceleration",
        "get_multiplier": "JointMotor.multiplier",
        **dict.fromkeys(("get_min_position", "get_max_position", "get_max_velocity"), "JointMotor.limits"),
        f"get_max_{effort}": "JointMotor.limits",
        f"set_available_{effort}": "JointMotor.set_available_effort",
        f"get_available_{effort}": "JointMotor.available_effort",
        f"{effort}_feedback_sensor/enable": "EffortFeedback.enable",
        f"{effort}_feedback_sensor/get_sampling_period": "EffortFeedback.sampling_period_ms",
        f"{effort}_feedback": "EffortFeedback.value",
    }


_DEVICES: Final[Mapping[str, Mapping[str, str]]] = {
    "DistanceSensor": {
        "get_min_value": "DistanceSensor.min_value",
        "get_max_value": "DistanceSensor.max_value",
        "get_aperture": "DistanceSensor.aperture_rad",
        "get_type": "DistanceSensor.sensor_type",
    },
    "TouchSensor": {"get_type": "TouchSensor.sensor_type"},
    "RotationalMotor": _motor("torque"),
    "LinearMotor": _motor("force"),
    "GPS": {
        "get_coordinate_system": "GPS.geographic",
        "decimal_degrees_to_degrees_minutes_seconds": "GPS.degrees_minutes_seconds",
        "speed": "GPSSpeed.value",
        "speed_vector": "GPSVelocity.value",
    },
    "InertialUnit": {"get_noise": "InertialUnit.noise", "quaternion": "InertialUnit.value"},
    "LED": {"set_led": "LED.set", "get_led": "LED.value"},
    "Brake": {"set_damping_constant": "Brake.set_damping"},
    "Camera": {
        "get_info": "Camera.info",
        "get_focus_info": "Camera.focus",
        "get_zoom_info": "Camera.zoom",
        "save_image": "Camera.save_image",
        "set_fov": "Camera.set_field_of_view",
        "set_focal_distance": "Camera.set_focal_distance",
        "set_exposure": "Camera.set_exposure",
        "get_exposure": "Camera.exposure",
        "has_recognition": "RecognizedObjects.recognizes",
        "recognition_has_segmentation": "SegmentedImage.segments",
        "recognition_enable_segmentation": "SegmentedImage.enable",
        "recognition_disable_segmentation": "SegmentedImage.disable",
        "recognition_is_segmentation_enabled": "SegmentedImage.segmenting",
        "recognition_save_segmentation_image": "SegmentedImage.save_image",
        "recognition_enable": "RecognizedObjects.enable",
        "recognition_get_sampling_period": "RecognizedObjects.sampling_period_ms",
        "image": "Camera.value",
        "camera_info": "CameraMatrix.value",
        "recognition_objects": "RecognizedObjects.value",
        "recognition_segmentation_image": "SegmentedImage.value",
    },
    "RangeFinder": {
        "get_info": "RangeFinder.info",
        "save_image": "RangeFinder.save_image",
        "range_image": "RangeFinder.value",
        "camera_info": "CameraMatrix.value",
    },
    "Radar": {
        "get_min_range": "Radar.min_range_m",
        "get_max_range": "Radar.max_range_m",
        "get_vertical_fov": "Radar.vertical_field_of_view_rad",
        "get_horizontal_fov": "Radar.field_of_view_rad",
        "targets": "Radar.value",
        "number_of_targets": "Radar.value",
    },
    "Emitter": {
        "send": "Emitter.send",
        "set_channel": "Emitter.set_channel",
        "set_range": "Emitter.set_range",
        "get_channel": "Emitter.channel",
        "get_range": "Emitter.range_m",
        "get_buffer_size": "Emitter.buffer_bytes",
    },
    "Receiver": {
        "set_channel": "Receiver.set_channel",
        "get_channel": "Receiver.channel",
        "get_queue_length": "Receiver.queue_length",
        "next_packet": "Receiver.take",
        "get_data_size": "Receiver.take",
        "get_signal_strength": "Receiver.take",
        "get_emitter_direction": "Receiver.take",
        "data": "Receiver.value",
    },
    "Speaker": {
        "play_sound": "Speaker.play",
        "stop": "Speaker.stop",
        "is_sound_playing": "Speaker.plays",
        "set_engine": "Speaker.set_engine",
        "set_language": "Speaker.set_language",
        "get_engine": "Speaker.engine",
        "get_language": "Speaker.language",
        "speak": "Speaker.speak",
        "is_speaking": "Speaker.speaking",
    },
    "Pen": {"write": "Pen.write", "set_ink_color": "Pen.set_ink"},
    "Connector": {
        "lock": "Connector.lock",
        "is_locked": "Connector.locked",
        "presence_sensor/enable": "ConnectorPresence.enable",
        "presence_sensor/get_sampling_period": "ConnectorPresence.sampling_period_ms",
        "presence": "ConnectorPresence.value",
    },
    "VacuumGripper": {
        "turn_on": "VacuumGripper.turn_on",
        "is_on": "VacuumGripper.on",
        "presence_sensor/enable": "VacuumPresence.enable",
        "presence_sensor/get_sampling_period": "VacuumPresence.sampling_period_ms",
        "presence": "VacuumPresence.value",
    },
    "Lidar": {
        "get_info": "Lidar.info",
        "get_frequency_info": "Lidar.frequency",
        "set_frequency": "Lidar.set_frequency",
        "enable_point_cloud": "LidarPoints.enable",
        "is_point_cloud_enabled": "LidarPoints.enabled",
        "get_layer_range_image": "Lidar.layer",
        "get_layer_point_cloud": "LidarPoints.layer",
        "range_image": "Lidar.value",
        "laser_scan": "LaserScan.value",
        "point_cloud": "LidarPoints.value",
    },
    "Display": {
        "get_info": "Display.size",
        "attach_camera": "Display.attach_camera",
        "detach_camera": "Display.detach_camera",
        "set_font": "Display.set_font",
        "set_color": "Display.set_color",
        "set_alpha": "Display.set_alpha",
        "set_opacity": "Display.set_opacity",
        **{f"draw_{shape}": f"Display.draw_{shape}" for shape in _SHAPES},
        **{f"fill_{shape}": f"Display.draw_{shape}" for shape in ("rectangle", "oval", "polygon")},
        "image_new": "Display.draw_image",
        "image_copy": "Display.copy",
        "image_paste": "Display.draw_image",
        "image_delete": "Display.draw_image",
        "image_load": "Display.draw_file",
        "image_save": "Display.save",
    },
    "Skin": {
        "get_bone_count": "Skin.bone_count",
        "get_bone_name": "Skin.bone_name",
        "get_bone_orientation": "Skin.bone_pose",
        "get_bone_position": "Skin.bone_pose",
        "set_bone_orientation": "Skin.set_bone_orientation",
        "set_bone_position": "Skin.set_bone_position",
    },
    "keyboard": {"key": "Keyboard.value"},
    "joystick": {
        "get_number_of_axes": "Joystick.number_of_axes",
        "get_number_of_povs": "Joystick.number_of_povs",
        "is_connected": "Joystick.connected",
        "set_constant_force": "Joystick.push",
        "set_constant_force_duration": "Joystick.push",
        "set_force_axis": "Joystick.push",
        "set_auto_centering_gain": "Joystick.resist",
        "set_resistance_gain": "Joystick.resist",
        "pressed_button": "Joystick.value",
        **dict.fromkeys((*(f"axis{at}" for at in range(6)), "pov0"), "Joystick.value"),
    },
}
_PARTS: Final = {
    "robot": _ROBOT,
    "palaestra": _OURS,
    "supervisor": _SUPERVISOR,
    "supervisor/node": _NODE,
    "supervisor/field": _FIELD,
}


def facade(group: str, path: str) -> str:
    """Return the member for a path of the world with every device, such as "Camera.info"; "" without one.

    Args:
        group: the owner of the path, as `groups` names it.
        path: the path below the name of the robot.

    Raises:
        KeyError: the path has no facade, and `WITHOUT` does not have it.
    """
    if path in WITHOUT or (group in DEVICES and path.endswith(f"/{_NAME}")):
        return ""
    if group in _PARTS:
        return _PARTS[group][path.removeprefix(f"{group}/")]
    name = path.removeprefix(f"{device_name(group) if group in DEVICES else group}/")
    own = _DEVICES.get(group, {}).get(name)
    return own or f"{_CLASSES.get(group, group)}.{_COMMON[name]}"

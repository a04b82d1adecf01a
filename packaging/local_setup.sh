# To be sourced behind the setup file of ROS 2, so that `ros2 run` and `ros2 launch` find the package.
export AMENT_PREFIX_PATH="@PREFIX@${AMENT_PREFIX_PATH:+:$AMENT_PREFIX_PATH}"
export PATH="@PREFIX@/bin${PATH:+:$PATH}"

"""ROS 2 node that follows a live mission of Pilotfish.

`node` has topics and parameters, `mission` the calls of the service, `conversion` the frames, and `following` what is
published when. Inside: north-east-down and forward-right-down, headings clockwise from north, SI, radians.
"""

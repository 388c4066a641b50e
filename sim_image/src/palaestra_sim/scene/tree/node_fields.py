"""The fields of the base types of nodes, except devices.

The fields and defaults come from resources/nodes/*.wrl of Webots R2023b.
"""

from __future__ import annotations

from typing import Final

_POSE = """
translation SFVec3f 0 0 0; rotation SFRotation 0 0 1 0; children MFNode;
translationStep SFFloat 0.01; rotationStep SFFloat 0.261799387
"""
SOLID_FIELDS = f"""{_POSE};
name SFString solid; model SFString; description SFString; contactMaterial SFString default;
immersionProperties MFNode; boundingObject SFNode; physics SFNode; locked SFBool FALSE;
radarCrossSection SFFloat 0; recognitionColors MFColor
"""
_LIGHT = """
ambientIntensity SFFloat 0; color SFColor 1 1 1; intensity SFFloat 1; on SFBool TRUE;
castShadows SFBool FALSE
"""
_JOINT = """
minStop SFFloat 0; maxStop SFFloat 0; springConstant SFFloat 0; dampingConstant SFFloat 0;
staticFriction SFFloat 0
"""
NODE_FIELDS: Final = {
    "WorldInfo": """
        info MFString; title SFString; window SFString; gravity SFFloat 9.81; CFM SFFloat 0.00001;
        ERP SFFloat 0.2; physics SFString; basicTimeStep SFFloat 32; FPS SFFloat 60;
        optimalThreadCount SFInt32 1; physicsDisableTime SFFloat 1;
        physicsDisableLinearThreshold SFFloat 0.01; physicsDisableAngularThreshold SFFloat 0.01;
        defaultDamping SFNode; inkEvaporation SFFloat 0; coordinateSystem SFString ENU;
        gpsCoordinateSystem SFString local; gpsReference SFVec3f 0 0 0; lineScale SFFloat 0.1;
        dragForceScale SFFloat 30; dragTorqueScale SFFloat 5; randomSeed SFInt32 0;
        contactProperties MFNode""",
    "Viewpoint": """
        fieldOfView SFFloat 0.785398; orientation SFRotation 0 0 1 0; position SFVec3f 0 0 0;
        description SFString; near SFFloat 0.05; far SFFloat 0; exposure SFFloat 1; follow SFString;
        followType SFString Tracking Shot; followSmoothness SFFloat 0.5; lensFlare SFNode;
        ambientOcclusionRadius SFFloat 2; bloomThreshold SFFloat -1""",
    "Background": """
        skyColor MFColor 0 0 0; backUrl MFString; bottomUrl MFString; frontUrl MFString; leftUrl MFString;
        rightUrl MFString; topUrl MFString; backIrradianceUrl MFString; bottomIrradianceUrl MFString;
        frontIrradianceUrl MFString; leftIrradianceUrl MFString; rightIrradianceUrl MFString;
        topIrradianceUrl MFString; luminosity SFFloat 1""",
    "DirectionalLight": f"{_LIGHT}; direction SFVec3f 0 0 -1",
    "PointLight": f"{_LIGHT}; attenuation SFVec3f 1 0 0; location SFVec3f 0 0 0; radius SFFloat 100",
    "SpotLight": f"""{_LIGHT}; attenuation SFVec3f 1 0 0; beamWidth SFFloat 1.570796;
        cutOffAngle SFFloat 0.785398; direction SFVec3f 0 0 -1; location SFVec3f 0 0 0; radius SFFloat 100""",
    "Fog": "color SFColor 1 1 1; fogType SFString LINEAR; visibilityRange SFFloat 0",
    "Group": "children MFNode",
    "Billboard": "children MFNode",
    "Pose": _POSE,
    "Transform": f"{_POSE}; scale SFVec3f 1 1 1",
    "Solid": SOLID_FIELDS,
    "Track": f"""{SOLID_FIELDS};
        name SFString track; device MFNode; textureAnimation SFVec2f 0 0; animatedGeometry SFNode;
        geometriesCount SFInt32 10""",
    "Charger": f"""{SOLID_FIELDS};
        name SFString charger; battery MFFloat; radius SFFloat 0.04; emissiveColor SFColor 0 1 0;
        gradual SFBool TRUE""",
    "Fluid": f"""{_POSE};
        name SFString fluid; model SFString; description SFString; density SFFloat 1000;
        viscosity SFFloat 0.001; streamVelocity SFVec3f 0 0 0; boundingObject SFNode; locked SFBool FALSE""",
    "Robot": f"""{SOLID_FIELDS};
        name SFString robot; controller SFString <generic>; controllerArgs MFString;
        customData SFString; supervisor SFBool FALSE; synchronization SFBool TRUE; battery MFFloat;
        cpuConsumption SFFloat 10; selfCollision SFBool FALSE; window SFString <generic>;
        remoteControl SFString <none>""",
    "HingeJoint": "jointParameters SFNode; device MFNode; endPoint SFNode; position SFFloat 0",
    "SliderJoint": "jointParameters SFNode; device MFNode; endPoint SFNode; position SFFloat 0",
    "Hinge2Joint": """
        jointParameters SFNode; jointParameters2 SFNode; device MFNode; device2 MFNode; endPoint SFNode;
        position SFFloat 0; position2 SFFloat 0""",
    "BallJoint": """
        jointParameters SFNode; jointParameters2 SFNode; jointParameters3 SFNode; device MFNode;
        device2 MFNode; device3 MFNode; endPoint SFNode; position SFFloat 0; position2 SFFloat 0;
        position3 SFFloat 0""",
    "JointParameters": f"position SFFloat 0; axis SFVec3f 0 0 1; {_JOINT}",
    "BallJointParameters": f"position SFFloat 0; anchor SFVec3f 0 0 0; {_JOINT}",
    "HingeJointParameters": f"""
        position SFFloat 0; axis SFVec3f 1 0 0; anchor SFVec3f 0 0 0; {_JOINT};
        suspensionSpringConstant SFFloat 0;
        suspensionDampingConstant SFFloat 0; suspensionAxis SFVec3f 1 0 0; stopERP SFFloat -1;
        stopCFM SFFloat -1""",
    "Physics": """
        density SFFloat 1000; mass SFFloat -1; centerOfMass MFVec3f; inertiaMatrix MFVec3f;
        damping SFNode""",
    "Propeller": """
        shaftAxis SFVec3f 1 0 0; centerOfThrust SFVec3f 0 0 0; thrustConstants SFVec2f 1 0;
        torqueConstants SFVec2f 1 0; fastHelixThreshold SFFloat 75.4; device SFNode; fastHelix SFNode;
        slowHelix SFNode""",
    "Damping": "linear SFFloat 0.2; angular SFFloat 0.2",
    "ImmersionProperties": """
        fluidName SFString; referenceArea SFString immersed area; dragForceCoefficients SFVec3f 0 0 0;
        dragTorqueCoefficients SFVec3f 0 0 0; viscousResistanceForceCoefficient SFFloat 0;
        viscousResistanceTorqueCoefficient SFFloat 0""",
    "Slot": "type SFString; endPoint SFNode",
    "SolidReference": "solidName SFString",
    "TrackWheel": "position SFVec2f 0 0; radius SFFloat 0.1; inner SFBool TRUE; children MFNode",
    "ContactProperties": """
        material1 SFString default; material2 SFString default; coulombFriction MFFloat 1;
        frictionRotation SFVec2f 0 0; rollingFriction SFVec3f 0 0 0; bounce SFFloat 0.5;
        bounceVelocity SFFloat 0.01; forceDependentSlip MFFloat; softERP SFFloat 0.2;
        softCFM SFFloat 0.001""",
    "Shape": """
        appearance SFNode; geometry SFNode; castShadows SFBool TRUE; isPickable SFBool TRUE""",
    "CadShape": "url MFString; ccw SFBool TRUE; castShadows SFBool TRUE; isPickable SFBool TRUE",
    "Appearance": "material SFNode; texture SFNode; textureTransform SFNode; name SFString appearance",
    "Material": """
        ambientIntensity SFFloat 0.2; diffuseColor SFColor 0.8 0.8 0.8; emissiveColor SFColor 0 0 0;
        shininess SFFloat 0.2; specularColor SFColor 0 0 0; transparency SFFloat 0""",
    "PBRAppearance": """
        baseColor SFColor 1 1 1; baseColorMap SFNode; transparency SFFloat 0; roughness SFFloat 0;
        roughnessMap SFNode; metalness SFFloat 1; metalnessMap SFNode; IBLStrength SFFloat 1;
        normalMap SFNode; normalMapFactor SFFloat 1; occlusionMap SFNode; occlusionMapStrength SFFloat 1;
        emissiveColor SFColor 0 0 0; emissiveColorMap SFNode; emissiveIntensity SFFloat 1;
        textureTransform SFNode; name SFString PBRAppearance""",
    "ImageTexture": "url MFString; repeatS SFBool TRUE; repeatT SFBool TRUE; filtering SFInt32 4",
    "TextureTransform": """
        center SFVec2f 0 0; rotation SFFloat 0; scale SFVec2f 1 1; translation SFVec2f 0 0""",
    "TextureCoordinate": "point MFVec2f",
    "Coordinate": "point MFVec3f",
    "Normal": "vector MFVec3f",
    "Color": "color MFColor",
    "Box": "size SFVec3f 0.1 0.1 0.1",
    "Cylinder": """
        bottom SFBool TRUE; height SFFloat 2; radius SFFloat 1; side SFBool TRUE; top SFBool TRUE;
        subdivision SFInt32 36""",
    "Plane": "size SFVec2f 1 1",
    "Sphere": "radius SFFloat 1; subdivision SFInt32 1; ico SFBool TRUE",
    "Capsule": """
        bottom SFBool TRUE; height SFFloat 2; radius SFFloat 1; side SFBool TRUE; top SFBool TRUE;
        subdivision SFInt32 12""",
    "Cone": """
        bottomRadius SFFloat 1; height SFFloat 2; side SFBool TRUE; bottom SFBool TRUE;
        subdivision SFInt32 12""",
    "ElevationGrid": """
        height MFFloat; xDimension SFInt32 0; xSpacing SFFloat 1; yDimension SFInt32 0; ySpacing SFFloat 1;
        thickness SFFloat 1""",
    "IndexedFaceSet": """
        coord SFNode; normal SFNode; texCoord SFNode; ccw SFBool TRUE; convex SFBool TRUE;
        normalPerVertex SFBool TRUE; coordIndex MFInt32; normalIndex MFInt32; texCoordIndex MFInt32;
        creaseAngle SFFloat 0""",
    "IndexedLineSet": "coord SFNode; coordIndex MFInt32",
    "PointSet": "color SFNode; coord SFNode",
    "Mesh": "url MFString; ccw SFBool TRUE; name SFString; materialIndex SFInt32 -1",
    "Focus": """
        focalDistance SFFloat 0; focalLength SFFloat 0; maxFocalDistance SFFloat 0;
        minFocalDistance SFFloat 0""",
    "Zoom": "maxFieldOfView SFFloat 1.5; minFieldOfView SFFloat 0.5",
    "Lens": """
        center SFVec2f 0.5 0.5; radialCoefficients SFVec2f 0 0; tangentialCoefficients SFVec2f 0 0""",
    "LensFlare": """
        transparency SFFloat 0.4; scale SFFloat 1.5; bias SFFloat -0.9; dispersal SFFloat 0.6;
        samples SFInt32 4; haloWidth SFFloat 0.4; chromaDistortion SFFloat 2; blurIterations SFInt32 2""",
    "Recognition": """
        maxRange SFFloat 100; maxObjects SFInt32 -1; occlusion SFInt32 1; frameColor SFColor 1 0 0;
        frameThickness SFInt32 1; segmentation SFBool FALSE""",
    "Muscle": """
        volume SFFloat 0.01; startOffset SFVec3f 0 0 0; endOffset SFVec3f 0 0 0; color MFColor;
        castShadows SFBool TRUE; visible SFBool TRUE""",
}
